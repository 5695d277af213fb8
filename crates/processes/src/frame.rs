//! Frames on a pipe: magic, protocol version, length, CRC-32C, then the content in postcard's format.

use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{self, ErrorKind, Read, Write};
use thiserror::Error;

/// Begins every frame.
const MAGIC: [u8; 4] = *b"SVLV";

/// Counts changes of what the frames carry: supervisor and processes must be of one build.
const VERSION: u32 = 5;

/// No frame is longer, in bytes: a scenario and two models of 1 MiB each fit.
const MAX_LENGTH: usize = 8 << 20;

/// A frame that can't be read or written.
#[derive(Debug, Error)]
pub enum FrameError {
    /// The pipe failed, or ended inside a frame.
    #[error("pipe: {0}")]
    Io(#[from] io::Error),
    /// Something else than a frame.
    #[error("the frame begins with {found:?}, expected {MAGIC:?}")]
    Magic {
        /// The bytes in the magic's place.
        found: [u8; 4],
    },
    /// Another build.
    #[error("protocol version {found}, expected {VERSION}: supervisor and processes are of different builds")]
    Version {
        /// The version in the frame.
        found: u32,
    },
    /// A length that no frame has.
    #[error("a frame of {found} bytes, expected at most {MAX_LENGTH}")]
    Length {
        /// The length in the frame.
        found: usize,
    },
    /// Damaged content.
    #[error("CRC {found:#010x}, expected {expected:#010x}")]
    Crc {
        /// The CRC in the frame.
        found: u32,
        /// The CRC of what was received.
        expected: u32,
    },
    /// Content that doesn't fit its type.
    #[error("content: {0}")]
    Content(#[from] postcard::Error),
}

/// Writes one frame and flushes.
///
/// # Errors
/// [`FrameError::Io`], [`FrameError::Length`] or [`FrameError::Content`].
pub fn write_frame<T: Serialize>(mut pipe: impl Write, content: &T) -> Result<(), FrameError> {
    let body = postcard::to_stdvec(content)?;
    if body.len() > MAX_LENGTH {
        return Err(FrameError::Length { found: body.len() });
    }
    let mut frame = Vec::with_capacity(body.len() + 16);
    frame.extend_from_slice(&MAGIC);
    frame.extend_from_slice(&VERSION.to_le_bytes());
    frame.extend_from_slice(&(body.len() as u32).to_le_bytes());
    frame.extend_from_slice(&crc32c::crc32c(&body).to_le_bytes());
    frame.extend_from_slice(&body);
    pipe.write_all(&frame)?;
    Ok(pipe.flush()?)
}

/// Reads one frame; `None` where the pipe ends before it begins.
///
/// # Errors
/// [`FrameError`] for anything but a whole, undamaged frame of this build.
pub fn read_frame<T: DeserializeOwned>(mut pipe: impl Read) -> Result<Option<T>, FrameError> {
    let Some(magic) = word_or_end(&mut pipe)? else { return Ok(None) };
    if magic != MAGIC {
        return Err(FrameError::Magic { found: magic });
    }
    let version = u32::from_le_bytes(word(&mut pipe)?);
    if version != VERSION {
        return Err(FrameError::Version { found: version });
    }
    let length = u32::from_le_bytes(word(&mut pipe)?) as usize;
    if length > MAX_LENGTH {
        return Err(FrameError::Length { found: length });
    }
    let found = u32::from_le_bytes(word(&mut pipe)?);
    let mut body = vec![0; length];
    pipe.read_exact(&mut body)?;
    let expected = crc32c::crc32c(&body);
    if found != expected {
        return Err(FrameError::Crc { found, expected });
    }
    Ok(Some(postcard::from_bytes(&body)?))
}

fn word(pipe: &mut impl Read) -> io::Result<[u8; 4]> {
    let mut bytes = [0; 4];
    pipe.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn word_or_end(pipe: &mut impl Read) -> io::Result<Option<[u8; 4]>> {
    match word(pipe) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_cut_or_damaged_frame_is_refused(content: Vec<u64>, cut in 0_usize..64, bit in 0_usize..512) {
            let mut bytes = Vec::new();
            write_frame(&mut bytes, &content).unwrap();
            prop_assert_eq!(read_frame::<Vec<u64>>(&bytes[..]).unwrap(), Some(content));
            let cut = cut.min(bytes.len() - 1);
            let read = read_frame::<Vec<u64>>(&bytes[..cut]);
            let refused = if cut < 4 { matches!(read, Ok(None)) } else { read.is_err() };
            prop_assert!(refused, "cut at {}", cut);
            let bit = bit % (bytes.len() * 8);
            bytes[bit / 8] ^= 1 << (bit % 8);
            prop_assert!(read_frame::<Vec<u64>>(&bytes[..]).is_err());
        }
    }
}

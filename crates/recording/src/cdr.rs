//! CDR payloads: the four-byte header, messages of the loop, and the recorder's own two messages.
//!
//! CDR aligns to a value's size, counted from behind the four-byte header. Messages hold eight-byte fields
//! alone, and gaps keep their string last, so nothing needs padding.

use crate::{Gap, Topic};
use signals::{Body, Message};

/// What every payload begins with: CDR, little-endian, no options.
pub const HEADER: [u8; 4] = [0, 1, 0, 0];

/// Puts a message's payload into `out`, which is emptied first.
pub(crate) fn message<B: Body>(message: &Message<B>, out: &mut Vec<u8>) {
    begin(out);
    message.append_bytes(out);
}

/// Puts the payload of a message given as its bytes into `out`, which is emptied first.
pub(crate) fn bytes(message: &[u8], out: &mut Vec<u8>) {
    begin(out);
    out.extend_from_slice(message);
}

/// Puts a gap's payload into `out`, which is emptied first.
pub(crate) fn gap(gap: &Gap, out: &mut Vec<u8>) {
    begin(out);
    for word in [gap.generation, gap.first_missing, gap.missed] {
        out.extend_from_slice(&word.to_le_bytes());
    }
    string(gap.topic.path(), out);
}

/// Puts a note's payload into `out`, which is emptied first.
pub(crate) fn note(text: &str, out: &mut Vec<u8>) {
    begin(out);
    string(text, out);
}

/// What follows the CDR header; `None` where it is not ours.
pub(crate) fn body(payload: &[u8]) -> Option<&[u8]> {
    payload.strip_prefix(&HEADER)
}

/// A gap from its payload.
pub(crate) fn read_gap(payload: &[u8]) -> Option<Gap> {
    let (words, rest) = body(payload)?.split_at_checked(24)?;
    let mut words = words.as_chunks::<8>().0.iter().map(|chunk| u64::from_le_bytes(*chunk));
    let (generation, first_missing, missed) = (words.next()?, words.next()?, words.next()?);
    Some(Gap { topic: Topic::from_path(read_string(rest)?)?, generation, first_missing, missed })
}

/// A note from its payload.
pub(crate) fn read_note(payload: &[u8]) -> Option<String> {
    read_string(body(payload)?).map(str::to_owned)
}

fn begin(out: &mut Vec<u8>) {
    out.clear();
    out.extend_from_slice(&HEADER);
}

/// Length with the closing zero, bytes, zero. A text of 4 GiB or more is cut: nobody writes one.
fn string(text: &str, out: &mut Vec<u8>) {
    let length = u32::try_from(text.len() + 1).unwrap_or(u32::MAX);
    out.extend_from_slice(&length.to_le_bytes());
    out.extend(text.as_bytes().iter().take(length as usize - 1));
    out.push(0);
}

fn read_string(bytes: &[u8]) -> Option<&str> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let text = rest.get(..usize::try_from(u32::from_le_bytes(*length)).ok()?)?;
    core::str::from_utf8(text.strip_suffix(&[0])?).ok()
}

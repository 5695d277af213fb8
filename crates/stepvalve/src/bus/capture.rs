//! `stepvalve bus capture`: the frames of an interface into a pcapng file of bounded size, beside the loop.

use super::pcapng;
use crate::files::name;
use crate::keep::parse_size;
use crate::say::say;
use anyhow::{Context, anyhow};
use config::{Dimension, parse_quantity};
use realtime::PacketTap;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use supervisor::{Failure, Interruption, Outcome};

/// The longest frame, with what a card may leave on it, bytes.
const LONGEST_FRAME: usize = 2048;
/// So long a frame is waited for at once, ms: whether it shall end is looked at in between.
const WAIT_MS: u16 = 50;
/// What is in memory goes to the file once it is so long, bytes, or nothing came for [`WAIT_MS`].
const CHUNK_BYTES: usize = 64 << 10;
/// The smallest ring, bytes: some seconds at 1 kHz.
const SMALLEST: u64 = 1_000_000;
/// A day and more, s.
const LONGEST_S: f64 = 1e6;

/// What to capture.
#[derive(clap::Args)]
pub struct Capture {
    /// The network interface of the drive
    #[arg(value_name = "INTERFACE")]
    interface: String,
    /// The file to write; it must not exist
    #[arg(long, value_name = "FILE.pcapng")]
    out: PathBuf,
    /// How much is kept: the newest frames, in FILE and what came before them in FILE.1
    #[arg(long, value_name = "SIZE", default_value = "256MB")]
    size: String,
    /// How long, as 10s [default: until Ctrl-C or SIGTERM]
    #[arg(long = "for", value_name = "TIME")]
    duration: Option<String>,
}

/// Captures until told to end.
///
/// # Errors
/// [`Failure::Input`] for an interface, size, time or file that can't be used; [`Failure::Failed`] where the interface goes away
/// or the disk takes no more.
pub fn run(arguments: &Capture) -> Result<Outcome, Failure> {
    let Capture { interface, out, size, duration } = arguments;
    let bytes = parse_size(size).filter(|bytes| *bytes >= SMALLEST).ok_or_else(|| {
        Failure::Input(anyhow!("--size: found {size:?}, expected 1MB or more, as 64MB or 2GB"))
    })?;
    let until = duration.as_deref().map(end).transpose()?;
    let tap = PacketTap::open(interface).map_err(|error| Failure::Input(anyhow!("{interface}: {error}")))?;
    let mut ring = Ring::create(out, bytes, pcapng::header(interface)).map_err(Failure::Input)?;
    let interruption = Interruption::watch()?;
    let frames = fill(&tap, &mut ring, &interruption, until).with_context(|| name(out))?;
    let earlier =
        if ring.turned { format!("; earlier ones in {}", name(&ring.earlier)) } else { String::new() };
    say(format_args!("{}: {frames} frames of {interface}{earlier}", name(out)));
    Ok(Outcome::Done)
}

fn end(text: &str) -> Result<Instant, Failure> {
    let seconds = parse_quantity(text, Dimension::Time)
        .map_err(|error| Failure::Input(anyhow!("--for {text}: {error}")))?;
    if !(seconds > 0.0 && seconds <= LONGEST_S) {
        return Err(Failure::Input(anyhow!("--for: found {text}, expected a time above 0s")));
    }
    Ok(Instant::now() + Duration::from_secs_f64(seconds))
}

/// Writes frames until the end; how many.
fn fill(
    tap: &PacketTap,
    ring: &mut Ring,
    interruption: &Interruption,
    until: Option<Instant>,
) -> anyhow::Result<u64> {
    let mut buffer = [0; LONGEST_FRAME];
    let mut frames = 0;
    while !interruption.wanted() && until.is_none_or(|until| Instant::now() < until) {
        match tap.receive(&mut buffer, WAIT_MS)? {
            Some(frame) => {
                pcapng::packet(&mut ring.waiting, &frame);
                frames += 1;
                if ring.waiting.len() >= CHUNK_BYTES {
                    ring.write()?;
                }
            }
            None => ring.write()?,
        }
    }
    ring.write()?;
    Ok(frames)
}

/// Two files of half the size: the newer one is FILE, and takes the older one's place, FILE.1, when it is full.
struct Ring {
    path: PathBuf,
    earlier: PathBuf,
    header: Vec<u8>,
    half: u64,
    file: File,
    bytes: u64,
    waiting: Vec<u8>,
    /// Whether there is an older file.
    turned: bool,
}

impl Ring {
    fn create(path: &Path, bytes: u64, header: Vec<u8>) -> anyhow::Result<Self> {
        let mut earlier = path.as_os_str().to_owned();
        earlier.push(".1");
        let earlier = PathBuf::from(earlier);
        if earlier.exists() {
            return Err(anyhow!("{} exists: give --out another name", name(&earlier)));
        }
        let mut file = File::create_new(path).with_context(|| name(path))?;
        file.write_all(&header).with_context(|| name(path))?;
        Ok(Self {
            path: path.to_owned(),
            earlier,
            bytes: header.len() as u64,
            header,
            half: bytes / 2,
            file,
            waiting: Vec::new(),
            turned: false,
        })
    }

    /// Hands what waits to the system: whole blocks, so that a capture that is killed can be read.
    fn write(&mut self) -> anyhow::Result<()> {
        if self.bytes + self.waiting.len() as u64 > self.half {
            std::fs::rename(&self.path, &self.earlier)?;
            self.file = File::create_new(&self.path)?;
            self.file.write_all(&self.header)?;
            self.bytes = self.header.len() as u64;
            self.turned = true;
        }
        self.file.write_all(&self.waiting)?;
        self.bytes += self.waiting.len() as u64;
        self.waiting.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_are_kept_in_two_files_that_begin_with_a_header() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bus.pcapng");
        let mut ring = Ring::create(&path, 100, b"head".to_vec()).unwrap();
        for byte in 0..10 {
            ring.waiting.extend([byte; 16]);
            ring.write().unwrap();
        }
        // Two fit beside the header in 50 bytes.
        assert_eq!(std::fs::read(&path).unwrap(), [&b"head"[..], &[8; 16], &[9; 16]].concat());
        assert_eq!(std::fs::read(&ring.earlier).unwrap(), [&b"head"[..], &[6; 16], &[7; 16]].concat());
        assert!(Ring::create(&path, 100, Vec::new()).is_err(), "nothing is overwritten");
    }
}

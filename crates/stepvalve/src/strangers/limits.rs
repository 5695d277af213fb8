//! What a process that reads a strange file may take: memory and time, by the file's size.

use anyhow::Context;
use nix::sys::resource::{Resource, setrlimit};
use nix::unistd::alarm;
use std::path::Path;

/// Limits of a process, and of what it may hand over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Numbers handed over.
    pub numbers: usize,
    /// Address space, bytes.
    pub memory_bytes: u64,
    /// Time on a processor, s.
    pub cpu_s: u64,
}

/// Numbers in a log are never more than these: 2 GB.
const MOST_NUMBERS: u64 = 250_000_000;
/// Numbers that any file may unpack to, however small it is: 400 MB.
const ANY_NUMBERS: u64 = 50_000_000;
/// Address space for a program and what any file may need.
const ANY_BYTES: u64 = 512 << 20;
/// Time for any file, s; and how many bytes more may take a second more.
const ANY_S: u64 = 4;
const BYTES_PER_S: u64 = 16 << 20;
/// By the clock a process may take so many times its time on a processor: it waits for disks and for others.
const WAIT_TIMES: u64 = 10;

impl Limits {
    /// For a file that is handed over in blocks: its reader needs little memory.
    pub fn of_blocks(file: &Path) -> std::io::Result<Self> {
        Ok(Self::of_size(size(file)?, 1))
    }

    /// For a file that is unpacked as a whole before it is handed over.
    pub fn of_whole(file: &Path) -> std::io::Result<Self> {
        Ok(Self::of_size(size(file)?, 8))
    }

    /// For a file that is worked on where it is read.
    pub fn of_work(file: &Path) -> std::io::Result<Self> {
        let limits = Self::of_size(size(file)?, 8);
        Ok(Self { memory_bytes: limits.memory_bytes + ANY_BYTES, cpu_s: 2 * limits.cpu_s, ..limits })
    }

    /// For work on two files at once.
    pub fn and(&self, other: &Self) -> Self {
        Self {
            numbers: self.numbers + other.numbers,
            memory_bytes: self.memory_bytes + other.memory_bytes,
            cpu_s: self.cpu_s + other.cpu_s,
        }
    }

    fn of_size(bytes: u64, memory_per_byte: u64) -> Self {
        Self {
            // Twice the file's size in bytes, beside what any file may have.
            numbers: (ANY_NUMBERS + bytes / 4).min(MOST_NUMBERS) as usize,
            memory_bytes: ANY_BYTES + bytes.saturating_mul(memory_per_byte),
            cpu_s: ANY_S + bytes / BYTES_PER_S,
        }
    }

    /// Sets them for this process, for good. One that takes more ends: by a signal, or because memory is refused.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn enforce(&self) -> anyhow::Result<()> {
        let set = |what, limit| setrlimit(what, limit, limit).with_context(|| format!("{what:?}"));
        set(Resource::RLIMIT_AS, self.memory_bytes)?;
        set(Resource::RLIMIT_CORE, 0)?;
        // SIGXCPU ends a process that computes on, SIGALRM one that waits on.
        set(Resource::RLIMIT_CPU, self.cpu_s)?;
        alarm::set(u32::try_from(WAIT_TIMES * self.cpu_s).unwrap_or(u32::MAX));
        Ok(())
    }
}

fn size(file: &Path) -> std::io::Result<u64> {
    let facts = std::fs::metadata(file)?;
    if facts.is_file() {
        return Ok(facts.len());
    }
    // A pipe may never end.
    Err(std::io::Error::other("no regular file, expected one"))
}

//! What the process that reads a strange file is asked for, as its command line says it.

use super::limits::Limits;
use std::path::PathBuf;

/// Reads a file for another process.
#[derive(clap::Args)]
pub struct ReadFile {
    /// What it is
    #[arg(value_enum)]
    pub(super) kind: Kind,
    /// The file
    pub(super) file: PathBuf,
    /// The most numbers
    numbers: usize,
    /// The most memory, bytes
    memory_bytes: u64,
    /// The most time on a processor, s
    cpu_s: u64,
}

/// What a file is taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Kind {
    Log,
    Mat,
    Npy,
}

impl ReadFile {
    /// What its process may take.
    pub(super) fn limits(&self) -> Limits {
        Limits { numbers: self.numbers, memory_bytes: self.memory_bytes, cpu_s: self.cpu_s }
    }
}

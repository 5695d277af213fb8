//! What can go wrong with a record as a whole. A cut or damaged file is no error: see [`crate::Damage`].

use signals::Source;
use std::path::PathBuf;
use thiserror::Error;

/// Why a record can't be written or read.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The file could not be made; one that exists is never overwritten.
    #[error("{}: can't create the record: {source}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The disk did not take what was written. What was flushed before stays readable; a new segment may be begun.
    #[error("{}: can't write the record: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// This source publishes no such message.
    #[error("{body} is not published by the {publisher}")]
    WrongSource {
        /// The message's name.
        body: &'static str,
        /// Who was said to have sent it.
        publisher: Source,
    },
    /// The file could not be opened or read.
    #[error("{}: can't read the record: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file does not begin as an MCAP file.
    #[error("{}: not an MCAP file: it does not begin with the magic number", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// The file was not written by this program, or was cut before its first few kilobytes reached the disk.
    #[error("{}: not a stepvalve record: {missing}", path.display())]
    NotARecord {
        /// The file.
        path: PathBuf,
        /// What was looked for and not found.
        missing: String,
    },
    /// No file was given.
    #[error("a record consists of at least one file, none was given")]
    NoSegment,
    /// Two segments belong to different records, or stand in the wrong order.
    #[error("{}: its {what} is {found}, the segment's before it is {expected}: they are different records, to be read apart", path.display())]
    SegmentMismatch {
        /// The later segment.
        path: PathBuf,
        /// What differs.
        what: &'static str,
        /// What this segment says.
        found: String,
        /// What the one before says.
        expected: String,
    },
}

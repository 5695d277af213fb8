//! What can go wrong with a page.

use std::path::PathBuf;
use thiserror::Error;

/// Why a page can't be made or written.
#[derive(Debug, Error)]
pub enum ReportError {
    /// A signal has another number of samples than its time axis.
    #[error("a signal of {found} samples on a time axis of {expected}")]
    SampleCount {
        /// Samples of the signal.
        found: usize,
        /// Samples of the time axis.
        expected: usize,
    },
    /// Time is not finite or goes backwards.
    #[error(
        "row {row}: time {found_s} s after {before_s} s; expected a finite time that does not go backwards"
    )]
    Time {
        /// The row, from 0.
        row: usize,
        /// Its time.
        found_s: f64,
        /// The time of the row before; minus infinity in the first.
        before_s: f64,
    },
    /// The system refused: no such folder, no permission, disk full.
    #[error("{}: {source}", path.display())]
    Write {
        /// The page's file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

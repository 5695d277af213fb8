//! What can go wrong with a valve-log file.

use log_data::LogError;
use recording::RecordingError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a file can't be read, written or converted.
#[derive(Debug, Error)]
pub enum RunLogError {
    /// The system refused: not there, no permission, disk full.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// HDF5 refused: another kind of file, a cut one, a full disk.
    #[error("{}: {doing}: {source}", path.display())]
    Hdf5 {
        /// The file.
        path: PathBuf,
        /// What was being done.
        doing: String,
        /// What HDF5 said.
        source: hdf5::Error,
    },
    /// The file is HDF5, but not the format expected.
    #[error("{}: {place}: found {found}, expected {expected}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: String,
        /// What stands there.
        found: String,
        /// What should.
        expected: String,
    },
    /// The samples break a rule of valve-logs.
    #[error("{}: {source}", path.display())]
    Log {
        /// The file.
        path: PathBuf,
        /// The rule.
        source: LogError,
    },
    /// The record can't be read.
    #[error(transparent)]
    Record(#[from] RecordingError),
    /// The record holds no cycle at all.
    #[error("{}: the record holds no Feedback, so there is no cycle to write", path.display())]
    NoCycles {
        /// The record's first file.
        path: PathBuf,
    },
}

/// Adds the file's name, and what was being done with it, to an error of HDF5 or of the system.
pub(crate) trait Context<T> {
    fn context(self, path: &Path, doing: impl FnOnce() -> String) -> Result<T, RunLogError>;
}

impl<T> Context<T> for Result<T, hdf5::Error> {
    fn context(self, path: &Path, doing: impl FnOnce() -> String) -> Result<T, RunLogError> {
        self.map_err(|source| RunLogError::Hdf5 { path: path.to_owned(), doing: doing(), source })
    }
}

impl<T> Context<T> for Result<T, std::io::Error> {
    fn context(self, path: &Path, _: impl FnOnce() -> String) -> Result<T, RunLogError> {
        self.map_err(|source| RunLogError::Io { path: path.to_owned(), source })
    }
}

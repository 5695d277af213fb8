//! HDF5 files: valve-logs in and out, a record of the loop turned into one (`run.h5`), and tables of campaigns.
//!
//! A valve-log opens in h5py and in MATLAB's `h5read`. It appears under its name only when it is whole. This
//! crate runs HDF5's C code, so it belongs in tools, never in a process of the loop.
#![forbid(unsafe_code)]

mod atomic;
mod blocks;
mod columns;
mod convert;
mod cycles;
mod error;
mod h5;
mod mat;
mod messages;
mod read;
mod run_file;
mod runs;
mod table_file;
mod tables;
mod write;

pub use convert::{Summary, convert};
pub use error::RunLogError;
pub use mat::{MatArray, read_mat_arrays};
pub use read::{LogPart, Wanted, read_log, read_log_parts};
pub use run_file::{MissingMessages, NoteInLog, RunFile, RunSpan};
pub use table_file::{TableColumn, TableFile, TableValues, write_table};
pub use write::{Late, write_log, write_log_with_late};

/// Root attribute `format` of every valve-log.
pub const FORMAT: &str = "valve-log";
/// Root attribute `format_version` of the files written, and the only one read.
pub const FORMAT_VERSION: i64 = 1;

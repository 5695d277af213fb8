//! Files that others wrote are read in a process of their own.
//!
//! HDF5 is C code, and the parsers of MAT and NumPy files were not written against malice either: a single flipped bit can
//! crash them, or have them run without an end or ask for gigabytes. So `stepvalve` starts itself once more
//! (`stepvalve read-file`, hidden), with limits of memory and time, and takes the contents from a pipe. However that
//! process ends, here it is an error message that names the file.

mod array;
mod child;
mod frames;
mod limits;
mod mat;
mod npy;
mod parent;
mod request;

pub use child::read_file;
pub use limits::Limits;
pub use parent::{arrays, log, watched};
pub use request::ReadFile;

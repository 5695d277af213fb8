//! HDF5 files that appear whole or not at all.

use crate::error::Context;
use crate::{RunLogError, h5};
use std::path::Path;
use whole_file::Partial;

/// Lets `fill` write an HDF5 file beside `path` and gives it that name once it is whole and on the disk.
pub(crate) fn create<T, E: From<RunLogError>>(
    path: &Path,
    fill: impl FnOnce(&hdf5::File) -> Result<T, E>,
) -> Result<T, E> {
    let doing = || "writing".to_owned();
    let partial = Partial::beside(path).context(path, doing)?;
    let file = h5::create(partial.path()).context(path, doing)?;
    let filled = fill(&file)?;
    file.close().context(path, doing)?;
    partial.replace().context(path, doing)?;
    Ok(filled)
}

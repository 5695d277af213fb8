//! Files that appear whole or not at all.

use crate::error::Context;
use crate::{RunLogError, h5};
use std::fs::{File, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// Lets `fill` write an HDF5 file beside `path` and gives it that name once it is whole and on the disk.
/// Whatever goes wrong, a file that stood there before is untouched and no part of the new one is left.
pub(crate) fn create<T, E: From<RunLogError>>(
    path: &Path,
    fill: impl FnOnce(&hdf5::File) -> Result<T, E>,
) -> Result<T, E> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let doing = || "writing".to_owned();
    let partial = tempfile::Builder::new()
        .prefix(".")
        .suffix(".partial")
        // As any new file: the umask takes away what it takes.
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder)
        .context(path, doing)?
        .into_temp_path();
    let file = h5::create(&partial).context(path, doing)?;
    let filled = fill(&file)?;
    file.close().context(path, doing)?;
    File::open(&partial).and_then(|file| file.sync_all()).context(path, doing)?;
    partial.persist(path).map_err(|error| error.error).context(path, doing)?;
    Ok(filled)
}

//! Pages on disk: whole or not at all.

use crate::{Page, ReportError};
use std::fs::Permissions;
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

impl Page {
    /// Writes the page beside `path` and gives it that name once it is whole. Whatever goes wrong, a file that
    /// stood there before is untouched and no part of the new one is left.
    ///
    /// # Errors
    /// [`ReportError::Write`] where the system refuses.
    pub fn write_html(&self, path: &Path) -> Result<(), ReportError> {
        write(path, self.to_html().as_bytes())
            .map_err(|source| ReportError::Write { path: path.to_owned(), source })
    }
}

fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut partial = tempfile::Builder::new()
        .prefix(".")
        .suffix(".partial")
        // As any new file: the umask takes away what it takes.
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder)?;
    partial.write_all(bytes)?;
    partial.as_file().sync_all()?;
    partial.persist(path).map_err(|error| error.error)?;
    Ok(())
}

//! Pages on disk: whole or not at all.

use crate::{Page, ReportError};
use std::path::Path;

impl Page {
    /// Writes the page. It appears under its name when it is whole; one that was there is replaced.
    ///
    /// # Errors
    /// [`ReportError::Write`] where the system refuses.
    pub fn write_html(&self, path: &Path) -> Result<(), ReportError> {
        whole_file::write(path, self.to_html())
            .map_err(|source| ReportError::Write { path: path.to_owned(), source })
    }
}

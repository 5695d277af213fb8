//! The folder for the results: all files appear when all are whole.

use crate::files::name;
use anyhow::{Context, anyhow};
use std::path::{Path, PathBuf};
use supervisor::Failure;
use whole_file::Partial;

/// A folder without a diagnosis.
pub struct Results {
    folder: PathBuf,
}

const RESIDUALS: &str = "residuals.h5";

impl Results {
    /// Refuses a folder that holds a diagnosis.
    ///
    /// # Errors
    /// [`Failure::Input`] where it does.
    pub fn new(folder: &Path) -> Result<Self, Failure> {
        for file in ["diagnosis.json", "model-extended.toml", "report.html", RESIDUALS] {
            let path = folder.join(file);
            if path.exists() {
                return Err(Failure::Input(anyhow!("{} exists: give --out another folder", name(&path))));
            }
        }
        Ok(Self { folder: folder.to_owned() })
    }

    /// Writes texts by name, and what `residuals` writes to the path that it is given.
    ///
    /// # Errors
    /// Where the system refuses; no file is left then that was not whole.
    pub fn write(
        &self,
        texts: &[(String, String)],
        residuals: impl FnOnce(&Path) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        std::fs::create_dir_all(&self.folder).with_context(|| name(&self.folder))?;
        let mut written = vec![self.partial(RESIDUALS, residuals)?];
        for (file, text) in texts {
            written.push(self.partial(file, |path| Ok(std::fs::write(path, text)?))?);
        }
        for (partial, path) in written {
            partial.appear().with_context(|| name(&path))?;
        }
        Ok(())
    }

    fn partial(
        &self,
        file: &str,
        write: impl FnOnce(&Path) -> anyhow::Result<()>,
    ) -> anyhow::Result<(Partial, PathBuf)> {
        let path = self.folder.join(file);
        let partial = Partial::beside(&path).with_context(|| name(&path))?;
        write(partial.path()).with_context(|| name(&path))?;
        Ok((partial, path))
    }
}

//! The folder for the results: all files appear when all are whole.

use crate::files::name;
use anyhow::{Context, anyhow};
use std::path::{Path, PathBuf};
use study::{experiment, extended::rival_file};
use supervisor::Failure;
use valve_model::EffectId;
use whole_file::Partial;

/// A folder without a diagnosis, or with one that may be replaced.
pub struct Results {
    folder: PathBuf,
    replace: bool,
}

const RESIDUALS: &str = "residuals.h5";

impl Results {
    /// Refuses a folder that holds a diagnosis, unless that may be replaced.
    ///
    /// # Errors
    /// [`Failure::Input`] where it does.
    pub fn new(folder: &Path, replace: bool) -> Result<Self, Failure> {
        for file in ["diagnosis.json", "model-extended.toml", "report.html", RESIDUALS] {
            let path = folder.join(file);
            if path.exists() && !replace {
                let path = name(&path);
                return Err(Failure::Input(anyhow!("{path} exists: give --out another folder, or --force")));
            }
        }
        Ok(Self { folder: folder.to_owned(), replace })
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
            if self.replace { partial.replace() } else { partial.appear() }.with_context(|| name(&path))?;
        }
        self.remove_old_but(texts)
    }

    /// Models of rivals and experiments that the replaced diagnosis had and this one doesn't have.
    fn remove_old_but(&self, texts: &[(String, String)]) -> anyhow::Result<()> {
        let rivals = EffectId::ALL.iter().map(|id| rival_file(*id));
        let old = rivals.chain([experiment::TOML_FILE.to_owned(), experiment::CSV_FILE.to_owned()]);
        for file in old.filter(|old| self.replace && texts.iter().all(|(new, _)| new != old)) {
            let path = self.folder.join(file);
            if path.exists() {
                std::fs::remove_file(&path).with_context(|| name(&path))?;
            }
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

//! A campaign: what is measured, and what was thought and hidden.

use crate::truth::Truth;
use anyhow::{Context, Result};
use log_data::Log;
use std::path::Path;

/// A measured log, the model that was thought to describe it, and the truth.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// The runs.
    pub log: Log,
    /// The nominal model's file.
    pub model_toml: String,
    /// What is hidden.
    pub truth: Truth,
}

impl Campaign {
    /// Writes `log.h5`, `model.toml` and `truth.json` into a folder.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        run_log::write_log(&folder.join("log.h5"), &self.log)?;
        std::fs::write(folder.join("model.toml"), &self.model_toml)?;
        std::fs::write(folder.join("truth.json"), serde_json::to_string_pretty(&self.truth.json())? + "\n")?;
        Ok(())
    }
}

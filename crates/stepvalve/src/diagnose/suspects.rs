//! Laws that the caller suspects, `--hypothesis` and the file of `--effects`.

use crate::files::{self, name};
use diagnosis::Suspect;
use std::path::PathBuf;
use study::LawFile;
use supervisor::Failure;

/// Reads them.
///
/// # Errors
/// [`Failure::Input`]: a text that is no law, with its column; a file that can't be read, with line and column; a name given
/// twice.
pub fn read(hypotheses: &[String], effects: Option<&PathBuf>) -> Result<Vec<Suspect>, Failure> {
    let effects = effects.map(|file| Ok::<_, Failure>((name(file), files::read(file)?))).transpose()?;
    let effects = effects.as_ref().map(|(file, text)| LawFile { file, text });
    study::suspects(hypotheses, effects).map_err(Failure::Input)
}

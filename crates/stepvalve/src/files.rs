//! Texts that commands are given: read within bounds, and named as messages show them.

use anyhow::{Context, anyhow};
use std::io::Read;
use std::path::{Path, PathBuf};
use supervisor::Failure;

/// No configuration file is longer, in bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Reads a text file of bounded size.
///
/// # Errors
/// [`Failure::Input`] where it can't be read, is too long, or is not UTF-8.
pub fn read(path: &Path) -> Result<String, Failure> {
    let file = std::fs::File::open(path).with_context(|| name(path)).map_err(Failure::Input)?;
    let mut text = String::new();
    let read = file
        .take(MAX_BYTES + 1)
        .read_to_string(&mut text)
        .with_context(|| name(path))
        .map_err(Failure::Input)?;
    if read as u64 > MAX_BYTES {
        return Err(Failure::Input(anyhow!(
            "{}: longer than {MAX_BYTES} bytes, which no scenario or model is",
            name(path)
        )));
    }
    Ok(text)
}

/// A path as messages show it.
pub fn name(path: &Path) -> String {
    path.display().to_string()
}

pub fn beside(path: &Path, other: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(other)
}

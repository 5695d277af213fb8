//! Texts that commands are given: read within bounds, and named as messages show them.

use anyhow::{Context, anyhow};
use processes::segments_in;
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

/// Paths as messages show them, one behind the other.
pub fn names(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| name(path)).collect::<Vec<_>>().join(", ")
}

/// The run file of a run's folder; any other path as it is.
pub fn run_file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("run.h5") } else { path.to_owned() }
}

/// A record's segments, in order: files as they are; of a folder those of its run, or what a fault kept where there are no others.
///
/// # Errors
/// [`Failure::Input`] where a folder holds none.
pub fn segments(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut segments = Vec::new();
    for path in paths {
        if !path.is_dir() {
            segments.push(path.clone());
            continue;
        }
        let (faults, all): (Vec<_>, Vec<_>) =
            segments_in(path).into_iter().partition(|segment| segment.fault);
        let chosen = if all.is_empty() { faults } else { all };
        if chosen.is_empty() {
            return Err(Failure::Input(anyhow!(
                "{}: found no run-*.mcap in it, expected a record",
                name(path)
            )));
        }
        segments.extend(chosen.iter().map(|segment| segment.path(path)));
    }
    Ok(segments)
}

pub fn beside(path: &Path, other: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(other)
}

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
///
/// # Errors
/// [`Failure::Input`] for a folder without one; where it holds a record, with the command that makes one.
pub fn run_file(path: &Path) -> Result<PathBuf, Failure> {
    if !path.is_dir() {
        return Ok(path.to_owned());
    }
    let run = path.join("run.h5");
    if run.exists() {
        return Ok(run);
    }
    let folder = name(path);
    Err(Failure::Input(if segments_in(path).is_empty() {
        anyhow!(
            "{folder}: found neither run.h5 nor a record (run-*.mcap) in it, expected the folder of a run"
        )
    } else {
        anyhow!(
            "{folder}: it holds a record, expected a run file: first stepvalve convert {folder} --out run.h5"
        )
    }))
}

/// A record's segments, in order: files as they are; of a folder all of it, those that a fault kept too.
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
        let found = segments_in(path);
        if found.is_empty() {
            return Err(Failure::Input(anyhow!(
                "{}: found no run-*.mcap in it, expected a record",
                name(path)
            )));
        }
        segments.extend(found.iter().map(|segment| segment.path(path)));
    }
    Ok(segments)
}

pub fn beside(path: &Path, other: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(other)
}

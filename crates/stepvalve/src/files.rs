//! Texts that commands are given: read within bounds, and named as messages show them.

use anyhow::{Context, anyhow};
use processes::segments_in;
use std::io::Read;
use std::path::{Path, PathBuf};
use supervisor::Failure;

/// No configuration file is longer, in bytes.
const MAX_BYTES: u64 = 1 << 20;
/// What an HDF5 file begins with.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Reads a text file of bounded size.
///
/// # Errors
/// [`Failure::Input`] where it can't be read, is too long, or is not UTF-8.
pub fn read(path: &Path) -> Result<String, Failure> {
    let file = std::fs::File::open(path).with_context(|| name(path)).map_err(Failure::Input)?;
    let mut bytes = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).with_context(|| name(path)).map_err(Failure::Input)?;
    let no_text = |found: &str| {
        Failure::Input(anyhow!(
            "{}: found {found}, expected a text file such as a scenario or a model",
            name(path)
        ))
    };
    if bytes.starts_with(HDF5) {
        return Err(no_text("an HDF5 file, which report, inspect and diagnose read"));
    }
    if bytes.len() as u64 > MAX_BYTES {
        return Err(no_text(&format!("more than {MAX_BYTES} bytes")));
    }
    String::from_utf8(bytes)
        .map_err(|error| no_text(&format!("no UTF-8 in byte {}", error.utf8_error().valid_up_to() + 1)))
}

/// Whether a file can be written: nothing is there, or may be replaced, and its folder is.
///
/// # Errors
/// [`Failure::Input`].
pub fn room_for(out: &Path, force: bool) -> Result<(), Failure> {
    if out.exists() && !force {
        return Err(Failure::Input(anyhow!("{} exists: give --out another name, or --force", name(out))));
    }
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.is_dir());
    folder.map_or(Ok(()), |folder| {
        Err(Failure::Input(anyhow!("{}: there is no folder {}", name(out), name(folder))))
    })
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
            "{folder}: it holds a record, expected a run file: first stepvalve convert {folder} --out {folder}/run.h5"
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

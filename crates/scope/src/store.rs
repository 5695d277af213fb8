//! The folder of saved captures.

use crate::capture::{Capture, Unreadable};
use recording::RecordingError;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Numbers that are tried for a new file.
const NUMBERS: std::ops::RangeInclusive<u32> = 1..=99_999;

/// Where captures are saved, and how many by themselves.
#[derive(Debug, Clone)]
pub(crate) struct Store {
    folder: PathBuf,
    /// Files that the user named, which may lie elsewhere.
    named: Vec<PathBuf>,
    /// The program that turns a record into HDF5.
    converter: PathBuf,
    /// Captures that save themselves end when so many are in the folder.
    pub(crate) limit: usize,
}

/// A saved capture.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Saved {
    pub(crate) name: String,
    /// Whether it is there as HDF5 too.
    hdf5: bool,
}

/// Why a capture was not saved.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NotSaved {
    #[error("{path}: {source}")]
    Folder { path: String, source: std::io::Error },
    #[error("{0}: no number is free")]
    Full(String),
    #[error(transparent)]
    Record(#[from] RecordingError),
    #[error("{0}: saved, but not converted to HDF5: {1}")]
    Hdf5(String, String),
}

impl Store {
    pub(crate) fn new(folder: PathBuf, named: Vec<PathBuf>, converter: PathBuf, limit: usize) -> Self {
        Self { folder, named, converter, limit }
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Saves a capture; its path.
    ///
    /// # Errors
    /// [`NotSaved`]; no other file is touched.
    pub(crate) fn save(&self, capture: &Capture) -> Result<PathBuf, NotSaved> {
        let shown = self.folder.display().to_string();
        std::fs::create_dir_all(&self.folder)
            .map_err(|source| NotSaved::Folder { path: shown.clone(), source })?;
        let names = self.names();
        let next = names.iter().filter_map(|name| number(name)).max().map_or(1, |last| last + 1);
        let free = NUMBERS.contains(&next).then_some(next).ok_or(NotSaved::Full(shown))?;
        let path = self.folder.join(format!("capture-{free:04}-{}.mcap", capture.cause.word));
        capture.write(&path)?;
        Ok(path)
    }

    /// Turns a saved capture into HDF5 beside it: by another process, since that library can crash.
    ///
    /// # Errors
    /// [`NotSaved::Hdf5`] with what the process said.
    pub(crate) fn convert(&self, path: &Path) -> Result<(), NotSaved> {
        let failed = |why: String| NotSaved::Hdf5(path.display().to_string(), why);
        let mut command = Command::new(&self.converter);
        command.arg("convert").arg(path).arg("--out").arg(path.with_extension("h5"));
        let output = command.stdin(Stdio::null()).output().map_err(|error| failed(error.to_string()))?;
        if output.status.success() {
            return Ok(());
        }
        Err(failed(String::from_utf8_lossy(&output.stderr).trim().to_owned()))
    }

    /// The names of the captures in the folder.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
        names.filter(|name| number(name).is_some()).collect()
    }

    /// The file that is shown first: the first that the user named.
    pub(crate) fn first(&self) -> Option<String> {
        self.named.first().map(|path| path.display().to_string())
    }

    /// The captures that can be opened: those of the folder, and those that the user named.
    pub(crate) fn list(&self) -> Vec<Saved> {
        let mut found = self.names();
        found.sort();
        found.extend(self.named.iter().map(|path| path.display().to_string()));
        let hdf5 = |name: &String| self.path(name).is_some_and(|path| path.with_extension("h5").exists());
        found.into_iter().map(|name| Saved { hdf5: hdf5(&name), name }).collect()
    }

    /// Opens one of them.
    ///
    /// # Errors
    /// [`Unreadable`]; `None` for a name that is not in the list.
    pub(crate) fn open(&self, name: &str, id: u64) -> Option<Result<Capture, Unreadable>> {
        Some(Capture::read(&self.path(name)?, id))
    }

    fn path(&self, name: &str) -> Option<PathBuf> {
        let named = self.named.iter().find(|path| path.display().to_string() == name).cloned();
        named.or_else(|| number(name).map(|_| self.folder.join(name)))
    }
}

/// The number in `capture-0007-edge.mcap`; `None` for any other name, so that none leads out of the folder.
fn number(name: &str) -> Option<u32> {
    let (digits, word) = name.strip_prefix("capture-")?.strip_suffix(".mcap")?.split_once('-')?;
    let plain = word.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'-');
    plain.then(|| digits.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_leads_out_of_the_folder() {
        assert_eq!(number("capture-0007-edge.mcap"), Some(7));
        for bad in [
            "../x.mcap",
            "capture-1-../../x.mcap",
            "capture-x-edge.mcap",
            "run-0001.mcap",
            "",
            "capture-1-a/b.mcap",
        ] {
            assert_eq!(number(bad), None, "{bad}");
        }
    }
}

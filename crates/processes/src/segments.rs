//! The names of a record's segments: `run-0001.mcap`, and `run-0007-fault.mcap` for one that is kept for a fault in it.

use std::path::{Path, PathBuf};

/// A segment's file.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct SegmentName {
    /// Counts segments from 1.
    pub number: u32,
    /// Whether it is kept for a fault.
    pub fault: bool,
}

impl SegmentName {
    /// The file in `folder`.
    pub fn path(&self, folder: &Path) -> PathBuf {
        let suffix = if self.fault { "-fault" } else { "" };
        folder.join(format!("run-{:04}{suffix}.mcap", self.number))
    }

    fn of(file: &str) -> Option<Self> {
        let stem = file.strip_prefix("run-")?.strip_suffix(".mcap")?;
        let (digits, fault) = stem.strip_suffix("-fault").map_or((stem, false), |digits| (digits, true));
        Some(Self { number: digits.parse().ok()?, fault })
    }
}

/// The segments in a folder, in order; none where it can't be read.
pub fn segments_in(folder: &Path) -> Vec<SegmentName> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<_> =
        entries.filter_map(|entry| SegmentName::of(&entry.file_name().to_string_lossy())).collect();
    names.sort_unstable();
    names
}

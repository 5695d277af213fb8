//! The journal's file: a line of JSON for each event, in two files of bounded size.

use super::entry::Entry;
use anyhow::{Context, Result};
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The file is put aside at this size, in bytes: some 100,000 events.
const FULL: u64 = 16 << 20;

/// The journal's file in a record's folder.
pub fn journal_path(folder: &Path) -> PathBuf {
    folder.join("events.jsonl")
}

/// Where the file goes when it is full; the one that is there goes.
pub fn older_journal_path(folder: &Path) -> PathBuf {
    folder.join("events-older.jsonl")
}

/// The open file.
pub(super) struct JournalFile {
    folder: PathBuf,
    file: File,
    size: u64,
}

impl JournalFile {
    /// Goes on where an earlier start of the instance ended.
    ///
    /// # Errors
    /// Where the file can't be written.
    pub(super) fn open(folder: &Path) -> Result<Self> {
        let path = journal_path(folder);
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .read(true)
            .open(&path)
            .with_context(|| path.display().to_string())?;
        let size = end_line(&mut file).with_context(|| path.display().to_string())?;
        Ok(Self { folder: folder.to_owned(), file, size })
    }

    /// Appends a line, in one write, so that no reader sees half of it.
    ///
    /// # Errors
    /// Where the disk does not take it.
    pub(super) fn append(&mut self, entry: &Entry) -> Result<()> {
        if self.size >= FULL {
            std::fs::rename(journal_path(&self.folder), older_journal_path(&self.folder))?;
            *self = Self::open(&self.folder)?;
        }
        let mut line = serde_json::to_vec(entry)?;
        line.push(b'\n');
        self.file.write_all(&line)?;
        self.size += line.len() as u64;
        Ok(())
    }
}

/// Ends a line that a crash cut off; the file's size.
fn end_line(file: &mut File) -> std::io::Result<u64> {
    let size = file.metadata()?.len();
    if size == 0 {
        return Ok(0);
    }
    file.seek(SeekFrom::End(-1))?;
    let mut last = [0];
    file.read_exact(&mut last)?;
    if last == *b"\n" {
        return Ok(size);
    }
    file.write_all(b"\n")?;
    Ok(size + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::journal::entry::EventKind;

    fn entry(text: &str) -> Entry {
        Entry {
            time: "2026-11-23T12:00:00.000Z".to_owned(),
            instance: "bench".to_owned(),
            generation: 1,
            cycle: 7,
            event: EventKind::Note,
            by: None,
            text: text.to_owned(),
        }
    }

    #[test]
    fn a_line_cut_off_by_a_crash_spoils_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = journal_path(folder.path());
        JournalFile::open(folder.path()).unwrap().append(&entry("one")).unwrap();
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, [&whole[..], b"{\"time\":\"2026"].concat()).unwrap();
        JournalFile::open(folder.path()).unwrap().append(&entry("two")).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines.len(), 3);
        let read = |line: &str| serde_json::from_str::<Entry>(line).ok();
        assert_eq!(
            lines.iter().map(|line| read(line)).collect::<Vec<_>>(),
            [Some(entry("one")), None, Some(entry("two"))]
        );
    }

    #[test]
    fn a_full_file_is_put_aside() {
        let folder = tempfile::tempdir().unwrap();
        let mut file = JournalFile::open(folder.path()).unwrap();
        file.append(&entry("before")).unwrap();
        file.size = FULL;
        file.append(&entry("after")).unwrap();
        let read = |path: PathBuf| std::fs::read_to_string(path).unwrap();
        assert!(read(older_journal_path(folder.path())).contains("before"));
        let now = read(journal_path(folder.path()));
        assert!(now.contains("after") && !now.contains("before"));
    }
}

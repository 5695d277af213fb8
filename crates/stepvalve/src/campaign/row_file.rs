//! `rows.log`: a row is in the file as soon as it is made, so that whatever ends this process costs no row that was.

use crate::files::name;
use ::campaign::Row;
use ::campaign::log::{self, Contents, Head};
use anyhow::{Context, anyhow};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use supervisor::Failure;

/// The log's name.
pub const ROWS: &str = "rows.log";
/// The table's name.
pub const TABLE: &str = "campaign.h5";
/// The page's name.
pub const PAGE: &str = "campaign.html";

/// A log that rows are added to. Nobody else writes to it meanwhile.
pub struct RowFile {
    file: File,
    path: PathBuf,
    rows: BTreeMap<u64, Row>,
    /// What is no whole row.
    pub dropped_bytes: usize,
}

impl RowFile {
    /// Begins a log, or goes on with the one that is there, of a campaign of so many runs.
    ///
    /// # Errors
    /// [`Failure::Input`] where there is a campaign and neither `resume` nor `force`; where it is another one; where another process
    /// writes to it.
    pub fn open(
        folder: &Path,
        (head, runs): (&Head, u64),
        resume: bool,
        force: bool,
    ) -> Result<Self, Failure> {
        let path = folder.join(ROWS);
        let begin = log::begin(head).map_err(Failure::input)?;
        let was_there = path.exists();
        std::fs::create_dir_all(folder).with_context(|| name(folder)).map_err(Failure::Input)?;
        // Locked before anything is looked at: what is found is then what there is to go on with.
        let file = locked(&path)?;
        let found = match may_begin(folder, &file, resume, force) {
            Ok(()) if resume => found(&path, &begin, head),
            Ok(()) => Ok(None),
            Err(refused) => Err(refused),
        };
        let found = match found {
            Err(refused) if !was_there => {
                remove(&path)?;
                return Err(refused);
            }
            found => found?,
        };
        let mut this = Self { file, path, rows: BTreeMap::new(), dropped_bytes: 0 };
        match found {
            Some((contents, length)) => {
                this.dropped_bytes = length - contents.whole_bytes + contents.damaged_bytes;
                this.begin_at(contents.whole_bytes as u64, &[]).with_context(|| name(&this.path))?;
                // What is no run of the plan counts for none.
                this.rows = contents.rows.into_iter().filter(|(run, _)| *run < runs).collect();
            }
            None => {
                for old in [TABLE, PAGE] {
                    remove(&folder.join(old))?;
                }
                this.begin_at(0, &begin).with_context(|| name(&this.path))?;
            }
        }
        Ok(this)
    }

    fn begin_at(&mut self, length: u64, bytes: &[u8]) -> io::Result<()> {
        self.file.set_len(length)?;
        self.file.seek(SeekFrom::End(0))?;
        self.file.write_all(bytes)
    }

    /// Adds a row: it is with the system when this returns.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn add(&mut self, row: Row) -> Result<(), Failure> {
        let bytes = log::row(&row).map_err(anyhow::Error::from)?;
        self.file.write_all(&bytes).with_context(|| name(&self.path))?;
        self.rows.insert(row.run, row);
        Ok(())
    }

    /// The rows by their runs.
    pub fn rows(&self) -> &BTreeMap<u64, Row> {
        &self.rows
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Waits until all is on the disk.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn to_disk(&self) -> io::Result<()> {
        self.file.sync_all()
    }
}

/// Whether a campaign may begin in a folder, or go on there: its log is held by this process.
fn may_begin(folder: &Path, file: &File, resume: bool, force: bool) -> Result<(), Failure> {
    let is_empty = file.metadata().with_context(|| name(folder)).map_err(Failure::Input)?.len() == 0;
    if force {
        return Ok(());
    }
    let made = [TABLE, PAGE].iter().map(|made| folder.join(made)).find(|path| path.exists());
    match (resume, is_empty, made) {
        (true, true, Some(made)) => Err(Failure::Input(anyhow!(
            "{}: found it without {ROWS}, expected the rows that it was made of: --force begins anew; or give --out another folder",
            name(&made)
        ))),
        (false, false, _) => Err(taken(&folder.join(ROWS))),
        (false, true, Some(made)) => Err(taken(&made)),
        _ => Ok(()),
    }
}

fn taken(path: &Path) -> Failure {
    Failure::Input(anyhow!(
        "{} exists: --resume goes on with it, --force begins anew; or give --out another folder",
        name(path)
    ))
}

/// Refuses a folder that holds a campaign.
///
/// # Errors
/// [`Failure::Input`].
pub fn refuse_taken(folder: &Path) -> Result<(), Failure> {
    match [ROWS, TABLE, PAGE].iter().map(|file| folder.join(file)).find(|path| path.exists()) {
        Some(path) => Err(taken(&path)),
        None => Ok(()),
    }
}

/// Reads a log.
///
/// # Errors
/// Where the system refuses, or it is none.
pub fn read(path: &Path) -> Result<(Contents, usize), Failure> {
    let bytes = bytes(path).with_context(|| name(path)).map_err(Failure::Input)?;
    let contents = log::read(&bytes).with_context(|| name(path)).map_err(Failure::Input)?;
    Ok((contents, bytes.len()))
}

/// What a log holds that is to be gone on with; `None` where there is none, or not even its head is whole.
fn found(path: &Path, begin: &[u8], head: &Head) -> Result<Option<(Contents, usize)>, Failure> {
    let start = match bytes(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        other => other.with_context(|| name(path)).map_err(Failure::Input)?,
    };
    if begin.starts_with(&start) {
        return Ok(None);
    }
    let (contents, length) = read(path)?;
    let differences = contents.head.differences(head);
    if !differences.is_empty() {
        return Err(Failure::Input(anyhow!(
            "{}: found rows of another campaign: changed since: {}; expected the same. Give --out another folder, or --force to begin anew",
            name(path),
            differences.join("; ")
        )));
    }
    Ok(Some((contents, length)))
}

fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn locked(path: &Path) -> Result<File, Failure> {
    let options = || OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
    let file = options().with_context(|| name(path)).map_err(Failure::Input)?;
    file.try_lock().map_err(|_| {
        Failure::Input(anyhow!("{}: another campaign writes to it, expected none", name(path)))
    })?;
    Ok(file)
}

fn remove(path: &Path) -> Result<(), Failure> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(Failure::Failed(anyhow::Error::from(error).context(name(path))))
        }
        _ => Ok(()),
    }
}

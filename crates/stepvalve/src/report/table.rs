//! The run file as the page needs it: the rows' times, and in which of them the controller followed.

use crate::files::name;
use run_log::{RunFile, RunLogError};
use signals::ControllerState;
use std::path::Path;

/// An open run file.
pub struct Table {
    /// The file.
    pub file: RunFile,
    /// Every row's time, s.
    pub time_s: Vec<f64>,
    /// Whether the controller followed the reference; all rows of a log that knows no controller.
    pub running: Vec<bool>,
    /// Whether the file tells of a controller.
    pub closed_loop: bool,
}

impl Table {
    /// Opens a file and reads times and states.
    ///
    /// # Errors
    /// [`RunLogError`].
    pub fn open(path: &Path) -> Result<Self, RunLogError> {
        let file = RunFile::open(path)?;
        let time_s = file.times_s()?;
        let code = ControllerState::Running.code() as f64;
        let states =
            file.column("state", |states| states.map(|state| state == code).collect::<Vec<bool>>())?;
        let closed_loop = states.is_some();
        let running = states.unwrap_or_else(|| vec![true; time_s.len()]);
        Ok(Self { file, time_s, running, closed_loop })
    }

    /// The run's title, or else its file's name.
    ///
    /// # Errors
    /// [`RunLogError`].
    pub fn title(&self, path: &Path) -> Result<String, RunLogError> {
        let title = self.file.text("title")?.filter(|title| !title.is_empty());
        Ok(title.unwrap_or_else(|| name(path.file_name().map_or(path, Path::new))))
    }

    /// A row's time, s.
    pub fn at(&self, row: usize) -> f64 {
        self.time_s.get(row).copied().unwrap_or(f64::NAN)
    }

    /// A signal of codes with the last one kept where a run misses a sample: what was the case goes on.
    pub fn held(&self, codes: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
        let mut spans = self.file.spans().map(|span| span.rows.clone()).peekable();
        let mut last = f64::NAN;
        codes.enumerate().map(move |(row, code)| {
            if spans.peek().is_some_and(|rows| row >= rows.end) {
                spans.next();
                last = f64::NAN;
            }
            if !code.is_nan() {
                last = code;
            }
            last
        })
    }

    /// The rows in which a column's value differs from the row before, and the values; gaps between equal values
    /// are no change. At most `most` of them, and whether there were more.
    ///
    /// # Errors
    /// [`RunLogError`].
    pub fn changes(&self, name: &str, most: usize) -> Result<(Vec<(usize, f64)>, bool), RunLogError> {
        let found = self.file.column(name, |values| {
            let mut changes: Vec<(usize, f64)> = Vec::new();
            let known = values.enumerate().filter(|(_, value)| !value.is_nan());
            for (row, value) in known {
                if changes.last().is_none_or(|last| last.1 != value) {
                    if changes.len() == most {
                        return (changes, true);
                    }
                    changes.push((row, value));
                }
            }
            (changes, false)
        })?;
        Ok(found.unwrap_or_default())
    }

    /// A column's values in some rows, which must be in order; NaN where there is none.
    ///
    /// # Errors
    /// [`RunLogError`].
    pub fn pick(&self, name: &str, rows: &[usize]) -> Result<Vec<f64>, RunLogError> {
        let picked = self.file.column(name, |values| {
            let mut wanted = rows.iter().copied().peekable();
            let mut picked = Vec::with_capacity(rows.len());
            for (row, value) in values.enumerate() {
                while wanted.next_if_eq(&row).is_some() {
                    picked.push(value);
                }
                if wanted.peek().is_none() {
                    break;
                }
            }
            picked
        })?;
        let mut picked = picked.unwrap_or_default();
        picked.resize(rows.len(), f64::NAN);
        Ok(picked)
    }
}

//! A valve-log read a column at a time: for runs that are too long to be held whole.

use crate::blocks::{Blocks, Part};
use crate::error::Context;
use crate::read::open;
use crate::{FORMAT, FORMAT_VERSION, RunLogError, h5};
use hdf5::types::VarLenUnicode;
use hdf5::{Dataset, Group};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// More runs, or members of a group, than this are refused.
const MAX_MEMBERS: u64 = 10_000;
/// More rows than this, all runs together, are refused: nearly three days at 1 kHz.
const MAX_ROWS: usize = 250_000_000;

/// An open valve-log: all its runs as one table on the log's clock. Between two runs stands a row in which every
/// column is NaN, so that nothing joins the end of one to the beginning of the next.
pub struct RunFile {
    path: PathBuf,
    file: hdf5::File,
    runs: Vec<(RunSpan, Group)>,
}

/// Where a run stands in the table.
#[derive(Debug, Clone, PartialEq)]
pub struct RunSpan {
    /// Its name in the log.
    pub name: String,
    /// Its kind, as in the log.
    pub kind: String,
    /// The instance's start that made it, where a record says so.
    pub generation: Option<u64>,
    /// The cycle of its first row, where it is made of cycles.
    pub first_cycle: Option<u64>,
    /// Its rows.
    pub rows: Range<usize>,
}

/// A note of the recorder, or what is wrong with one of the record's files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoteInLog {
    /// In words.
    pub text: String,
    /// The row after which it was taken, where that is known.
    pub row: Option<usize>,
}

/// Messages of one topic that are missing for one reason.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct MissingMessages {
    /// The topic, as in the record.
    pub topic: String,
    /// Who declared them missing.
    pub origin: String,
    /// How many they are.
    pub missed: u64,
}

impl RunFile {
    /// Opens a valve-log and finds its runs, in the order of their times.
    ///
    /// # Errors
    /// [`RunLogError`] where it can't be read or is no valve-log.
    pub fn open(path: &Path) -> Result<Self, RunLogError> {
        let file = open(path)?;
        let mut log = Self { path: path.to_owned(), file, runs: Vec::new() };
        log.check_format()?;
        log.find_runs()?;
        Ok(log)
    }

    /// A text among the root's attributes: `title`, `mode`, `instance`, ...
    ///
    /// # Errors
    /// [`RunLogError::Hdf5`].
    pub fn text(&self, name: &str) -> Result<Option<String>, RunLogError> {
        h5::text_attribute(&self.file, name).context(&self.path, || format!("attribute {name}"))
    }

    /// A number among the root's attributes: `period_s`, `messages_recorded`, ...
    ///
    /// # Errors
    /// [`RunLogError::Hdf5`].
    pub fn number(&self, name: &str) -> Result<Option<f64>, RunLogError> {
        h5::number_attribute(&self.file, name).context(&self.path, || format!("attribute {name}"))
    }

    /// The runs.
    pub fn spans(&self) -> impl Iterator<Item = &RunSpan> {
        self.runs.iter().map(|(span, _)| span)
    }

    /// Number of rows, those between runs included.
    pub fn rows(&self) -> usize {
        self.runs.last().map_or(0, |(span, _)| span.rows.end)
    }

    /// Every row's time, s. A row between two runs stands a sample after the first one's last, at most half-way to the next.
    ///
    /// # Errors
    /// [`RunLogError`]; [`RunLogError::Format`] where a time is not finite or not later than the one before.
    pub fn times_s(&self) -> Result<Vec<f64>, RunLogError> {
        let mut times = self.column("time", |times| times.collect::<Vec<f64>>())?.unwrap_or_default();
        for (span, _) in self.runs.iter().skip(1) {
            let between = span.rows.start - 1;
            let at = |row: Option<usize>| row.and_then(|row| times.get(row)).copied();
            let (last, after) = (at(between.checked_sub(1)), at(Some(span.rows.start)));
            // A sample after the run's last one: what was the case then does not go on until the next run.
            let period = last.zip(at(between.checked_sub(2))).map(|(last, earlier)| last - earlier);
            if let (Some(last), Some(after), Some(time)) = (last, after, times.get_mut(between)) {
                let half = (after - last) / 2.0;
                let period = period.filter(|period| period.is_finite() && *period > 0.0);
                *time = last + period.map_or(half, |period| period.min(half));
            }
        }
        let mut before = f64::NEG_INFINITY;
        for (row, &time) in times.iter().enumerate() {
            if !(time.is_finite() && time > before) {
                let found = format!("{time} s after {before} s in row {row}");
                return Err(self.format_error("time", &found, "finite times that grow"));
            }
            before = time;
        }
        Ok(times)
    }

    /// Whether any run has this column.
    pub fn has_column(&self, name: &str) -> bool {
        self.runs.iter().any(|(_, group)| group.link_exists(name))
    }

    /// A text among the attributes of a column: `source`, `unit`; the first run's that has it.
    ///
    /// # Errors
    /// [`RunLogError::Hdf5`].
    pub fn column_text(&self, column: &str, name: &str) -> Result<Option<String>, RunLogError> {
        let mut found = None;
        for (_, group) in &self.runs {
            if let (None, true) = (&found, group.link_exists(column)) {
                let doing = || format!("{column}: attribute {name}");
                let dataset = group.dataset(column).context(&self.path, doing)?;
                found = h5::text_attribute(&dataset, name).context(&self.path, doing)?;
            }
        }
        Ok(found)
    }

    /// Hands all values of a column, one for each row, to `visit`; a block of them is in memory at a time. NaN
    /// where a run has no such column. `None` where no run has it.
    ///
    /// # Errors
    /// [`RunLogError`]; what `visit` made of the values before is then lost.
    pub fn column<T>(
        &self,
        name: &str,
        visit: impl FnOnce(&mut dyn Iterator<Item = f64>) -> T,
    ) -> Result<Option<T>, RunLogError> {
        if !self.has_column(name) {
            return Ok(None);
        }
        let mut parts = Vec::new();
        for (index, (span, group)) in self.runs.iter().enumerate() {
            if index > 0 {
                parts.push(Part::Missing(1));
            }
            parts.push(match group.link_exists(name) {
                true => Part::Rows(self.dataset(group, name, Some(span.rows.len()))?),
                false => Part::Missing(span.rows.len()),
            });
        }
        self.visit(Blocks::new(parts), name, visit).map(Some)
    }

    /// The same for a column of a table beside the runs: `timing/plant-simulator` or `messages/set_point`.
    ///
    /// # Errors
    /// As [`RunFile::column`].
    pub fn table_column<T>(
        &self,
        table: &str,
        name: &str,
        visit: impl FnOnce(&mut dyn Iterator<Item = f64>) -> T,
    ) -> Result<Option<T>, RunLogError> {
        let Some(group) = self.group(table)?.filter(|group| group.link_exists(name)) else {
            return Ok(None);
        };
        let dataset = self.dataset(&group, name, None)?;
        self.visit(Blocks::new(vec![Part::Rows(dataset)]), name, visit).map(Some)
    }

    /// The processes that recorded their timing.
    ///
    /// # Errors
    /// [`RunLogError`].
    pub fn processes(&self) -> Result<Vec<String>, RunLogError> {
        match self.group("timing")? {
            Some(group) => self.members(&group, "timing"),
            None => Ok(Vec::new()),
        }
    }

    /// The texts that the run was made from, by name: `scenario`, `truth`, `belief`. Those that are empty are
    /// left out.
    ///
    /// # Errors
    /// [`RunLogError`].
    pub fn texts(&self) -> Result<Vec<(String, String)>, RunLogError> {
        let mut texts = Vec::new();
        for name in ["scenario", "truth", "belief"] {
            let Some(group) = self.group(name)?.filter(|group| group.link_exists("text")) else { continue };
            let doing = || format!("reading {name}/text");
            let dataset = group.dataset("text").context(&self.path, doing)?;
            let text = h5::text_of(&dataset).context(&self.path, doing)?.filter(|text| !text.is_empty());
            texts.extend(text.map(|text| (name.to_owned(), text)));
        }
        Ok(texts)
    }

    /// The facts of the machine, by name.
    ///
    /// # Errors
    /// [`RunLogError`].
    pub fn machine(&self) -> Result<Vec<(String, String)>, RunLogError> {
        let Some(group) = self.group("machine")? else { return Ok(Vec::new()) };
        let doing = || "reading machine".to_owned();
        let mut facts = Vec::new();
        for name in group.attr_names().context(&self.path, doing)?.into_iter().take(MAX_MEMBERS as usize) {
            let fact = h5::text_attribute(&group, &name).context(&self.path, doing)?;
            facts.extend(fact.map(|fact| (name, fact)));
        }
        Ok(facts)
    }

    /// The recorder's notes, and what is wrong with the record's files.
    ///
    /// # Errors
    /// [`RunLogError`].
    pub fn notes(&self) -> Result<Vec<NoteInLog>, RunLogError> {
        let texts = self.text_column(&self.file, "notes")?;
        let column = |name| self.table_column("noted", name, |values| values.collect::<Vec<f64>>());
        let generations = column("generation")?.unwrap_or_default();
        let cycles = column("cycle")?.unwrap_or_default();
        // -1 stands where nothing is known.
        let row_of = |(generation, cycle): (f64, f64)| {
            (cycle >= 0.0).then(|| self.row_of(generation as u64, cycle as u64)).flatten()
        };
        let after = generations.into_iter().zip(cycles).map(row_of);
        let rows = after.chain(std::iter::repeat(None));
        Ok(texts.into_iter().zip(rows).map(|(text, row)| NoteInLog { text, row }).collect())
    }

    /// The row of a generation's cycle; `None` of one that has none.
    pub fn row_of(&self, generation: u64, cycle: u64) -> Option<usize> {
        let span = self.spans().find(|span| span.generation == Some(generation))?;
        let row = usize::try_from(cycle.checked_sub(span.first_cycle?)?).ok()? + span.rows.start;
        span.rows.contains(&row).then_some(row)
    }

    /// What is known to be missing, by topic and origin.
    ///
    /// # Errors
    /// [`RunLogError`].
    pub fn missing(&self) -> Result<Vec<MissingMessages>, RunLogError> {
        let Some(group) = self.group("gaps")? else { return Ok(Vec::new()) };
        let missed = self.table_column("gaps", "missed", |missed| missed.collect::<Vec<f64>>())?;
        let topics = self.text_column(&group, "topic")?;
        let origins = self.text_column(&group, "origin")?;
        let mut sums: BTreeMap<(String, String), u64> = BTreeMap::new();
        for ((topic, origin), missed) in topics.into_iter().zip(origins).zip(missed.unwrap_or_default()) {
            let sum = sums.entry((topic, origin)).or_default();
            *sum = sum.saturating_add(missed as u64);
        }
        let missing = |((topic, origin), missed)| MissingMessages { topic, origin, missed };
        Ok(sums.into_iter().map(missing).collect())
    }

    fn check_format(&self) -> Result<(), RunLogError> {
        let found = self.text("format")?;
        if found.as_deref() != Some(FORMAT) {
            let found = found.map_or("none".to_owned(), |found| format!("{found:?}"));
            return Err(self.format_error("attribute format", &found, &format!("{FORMAT:?}")));
        }
        match self.number("format_version")? {
            Some(version) if version == FORMAT_VERSION as f64 => Ok(()),
            found => {
                let found = found.map_or("none".to_owned(), |found| found.to_string());
                Err(self.format_error("attribute format_version", &found, &FORMAT_VERSION.to_string()))
            }
        }
    }

    fn find_runs(&mut self) -> Result<(), RunLogError> {
        let Some(runs) = self.group("runs")? else {
            return Err(self.format_error("root", "no group /runs", "one"));
        };
        let mut found = Vec::new();
        for name in self.members(&runs, "/runs")? {
            // A dataset beside the runs is nobody's business.
            let Ok(group) = runs.group(&name) else { continue };
            let time = match group.link_exists("time") {
                true => self.dataset(&group, "time", None)?,
                false => return Err(self.format_error(&format!("/runs/{name}"), "no dataset time", "one")),
            };
            let doing = || format!("reading /runs/{name}/time");
            let begin = time.read_slice_1d::<f64, _>(0..time.size().min(1)).context(&self.path, doing)?;
            if let Some(&begin_s) = begin.first() {
                found.push((begin_s, time.size(), name, group));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, rows, name, group) in found {
            let span = self.span(name, &group, rows)?;
            self.runs.push((span, group));
        }
        Ok(())
    }

    fn span(&self, name: String, group: &Group, rows: usize) -> Result<RunSpan, RunLogError> {
        let start = if self.runs.is_empty() { 0 } else { self.rows() + 1 };
        let end = start.checked_add(rows).filter(|end| *end <= MAX_ROWS).ok_or_else(|| {
            let expected = format!("at most {MAX_ROWS} rows in all runs");
            self.format_error(&format!("/runs/{name}/time"), &format!("{rows} rows"), &expected)
        })?;
        let doing = || format!("attributes of /runs/{name}");
        let number = |attribute| h5::number_attribute(group, attribute).context(&self.path, doing);
        let (generation, first_cycle) = (number("generation")?, number("first_cycle")?);
        let kind = h5::text_attribute(group, "kind").context(&self.path, doing)?.unwrap_or_default();
        Ok(RunSpan {
            kind,
            generation: generation.map(|number| number as u64),
            first_cycle: first_cycle.map(|number| number as u64),
            rows: start..end,
            name,
        })
    }

    fn visit<T>(
        &self,
        mut blocks: Blocks,
        name: &str,
        visit: impl FnOnce(&mut dyn Iterator<Item = f64>) -> T,
    ) -> Result<T, RunLogError> {
        let made = visit(&mut blocks);
        blocks.finish().context(&self.path, || format!("reading {name}"))?;
        Ok(made)
    }

    /// A dataset that holds one column of numbers, `rows` of them where that is given.
    fn dataset(&self, group: &Group, name: &str, rows: Option<usize>) -> Result<Dataset, RunLogError> {
        let place = || format!("{}/{name}", group.name());
        let dataset = group.dataset(name).context(&self.path, || format!("{} is no dataset", place()))?;
        let expected = rows.unwrap_or(dataset.size());
        if h5::is_numeric(&dataset) && dataset.shape() == [expected] && expected <= MAX_ROWS {
            return Ok(dataset);
        }
        let kind = if h5::is_numeric(&dataset) { "numbers" } else { "something else" };
        let found = format!("{kind} of shape {:?}", dataset.shape());
        let expected = match rows {
            Some(rows) => format!("{rows} numbers"),
            None => format!("one column of at most {MAX_ROWS} numbers"),
        };
        Err(self.format_error(&place(), &found, &expected))
    }

    fn text_column(&self, group: &Group, name: &str) -> Result<Vec<String>, RunLogError> {
        if !group.link_exists(name) {
            return Ok(Vec::new());
        }
        let doing = || format!("reading {name}");
        let dataset = group.dataset(name).context(&self.path, doing)?;
        if dataset.size() as u64 > 100 * MAX_MEMBERS {
            let expected = format!("at most {}", 100 * MAX_MEMBERS);
            return Err(self.format_error(name, &format!("{} texts", dataset.size()), &expected));
        }
        let texts = dataset.read_raw::<VarLenUnicode>().context(&self.path, doing)?;
        Ok(texts.iter().map(|text| String::from_utf8_lossy(text.as_bytes()).into_owned()).collect())
    }

    /// A group by its path; `None` where a step on the way is missing.
    fn group(&self, path: &str) -> Result<Option<Group>, RunLogError> {
        let mut so_far = String::new();
        for step in path.split('/') {
            so_far.push_str(step);
            if !self.file.link_exists(&so_far) {
                return Ok(None);
            }
            so_far.push('/');
        }
        self.file.group(path).map(Some).context(&self.path, || format!("{path} is no group"))
    }

    fn members(&self, group: &Group, place: &str) -> Result<Vec<String>, RunLogError> {
        if group.len() > MAX_MEMBERS {
            let found = format!("{} members", group.len());
            return Err(self.format_error(place, &found, &format!("at most {MAX_MEMBERS}")));
        }
        group.member_names().context(&self.path, || format!("reading {place}"))
    }

    fn format_error(&self, place: &str, found: &str, expected: &str) -> RunLogError {
        RunLogError::Format {
            path: self.path.clone(),
            place: place.to_owned(),
            found: found.to_owned(),
            expected: expected.to_owned(),
        }
    }
}

//! Text with separators (CSV and its kin): lines to skip, a line of names, a line of units, then rows.

use crate::cells::Cells;
use crate::clock::{self, Days};
use crate::lines::Lines;
use crate::table::{CutLine, Table, Take};
use anyhow::{Context, anyhow, bail, ensure};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use std::str::FromStr;

/// What stands between the cells of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Separator {
    /// Tabs, else semicolons, else commas, else spaces: whichever the first line holds
    #[default]
    Auto,
    /// Tabs
    Tab,
    /// Commas
    Comma,
    /// Semicolons
    Semicolon,
    /// One space or several
    Space,
}

/// Whether the first line holds names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Header {
    /// Where it holds anything that is no number
    #[default]
    Auto,
    /// It does
    Yes,
    /// It doesn't: columns are c1, c2, ...
    No,
}

/// How many lines stand before the names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Number", into = "Number")]
pub enum Skip {
    /// So many.
    Lines(usize),
    /// As many as there are: what stands straight above the first rows of numbers are names, and units where both lines
    /// have as many cells as the rows.
    Auto,
}

/// As files write it.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Number {
    Lines(usize),
    Word(String),
}

impl Default for Skip {
    fn default() -> Self {
        Self::Lines(0)
    }
}

impl FromStr for Skip {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let lines = text.parse().map(Self::Lines);
        let refused = |_| format!("{text:?}, expected a number of lines, or auto");
        if text == "auto" { Ok(Self::Auto) } else { lines.map_err(refused) }
    }
}

impl TryFrom<Number> for Skip {
    type Error = String;

    fn try_from(number: Number) -> Result<Self, String> {
        match number {
            Number::Lines(lines) => Ok(Self::Lines(lines)),
            Number::Word(word) => word.parse(),
        }
    }
}

impl From<Skip> for Number {
    fn from(skip: Skip) -> Self {
        match skip {
            Skip::Lines(lines) => Self::Lines(lines),
            Skip::Auto => Self::Word("auto".to_owned()),
        }
    }
}

/// How a text is read.
#[derive(Debug, Clone, Default)]
pub struct Format {
    /// Between the cells.
    pub separator: Separator,
    /// Names in the first line.
    pub header: Header,
    /// Lines before the names, or before the rows where there are none.
    pub skip: Skip,
    /// Whether a line of units follows the names.
    pub units_line: bool,
    /// 1,5 is one and a half.
    pub decimal_comma: bool,
    /// Cells that say that a sample is missing, beside empty ones, "nan", "na", "n/a", "null" and dashes.
    pub missing: Vec<String>,
    /// How dates and times of day are written, as strptime has it, where they are not ISO 8601.
    pub time_format: Option<String>,
}

impl Format {
    /// Checks what can be checked without a file.
    ///
    /// # Errors
    /// What is wrong with the format of times.
    pub fn check(&self) -> Result<(), String> {
        self.time_format.as_deref().map_or(Ok(()), clock::check)
    }
}

/// So much of a file is looked at before it is read.
const LOOK_BYTES: u64 = 64 * 1024;
/// No table has more columns.
const MAX_COLUMNS: usize = 10_000;
/// So many lines are looked at for where the rows begin, when the first ones make no sense.
const LOOK_LINES: usize = 200;
/// What says that a sample is missing, in small letters.
const MISSING: &[&str] = &["", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "---"];
/// Editors hide it, so it is no part of a name.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// An open text.
pub struct Separated {
    rows: RowLines,
    reader: CellReader,
    units: Vec<String>,
}

/// The lines that hold rows.
pub(crate) struct RowLines {
    lines: Lines<BufReader<File>>,
    cells: Cells,
    /// The first line and its number, where it holds numbers.
    first: Option<(u64, Vec<u8>)>,
    /// The last line, left out because it was cut off.
    cut: Option<CutLine>,
}

/// Rows before a last one that tell how long its last cell should be.
const ROWS_TO_COMPARE: usize = 3;

/// Reads cells, and complains with their place.
#[derive(Default)]
pub(crate) struct CellReader {
    names: Vec<String>,
    format: Format,
    /// For each column, the day that its times of day have come to.
    days: Vec<Days>,
    /// What to try where a cell makes no sense.
    hint: String,
    /// Which of `format.missing` a cell has said.
    said: BTreeSet<usize>,
}

impl Separated {
    /// Opens a text and reads its names.
    ///
    /// # Errors
    /// A file that can't be read, is no text, or is empty.
    pub fn open(path: &Path, format: &Format) -> anyhow::Result<Self> {
        Self::begin(path, format).with_context(|| path.display().to_string())
    }

    fn begin(path: &Path, format: &Format) -> anyhow::Result<Self> {
        let look = look(path)?;
        text_only(&look)?;
        let mut reader = CellReader { format: format.clone(), ..CellReader::default() };
        let found = found_rows(&reader, format, &look);
        let (skip, units_line) = match (format.skip, &found) {
            (Skip::Lines(lines), _) => (lines, format.units_line),
            (Skip::Auto, Some(found)) => (found.skip, found.units_line),
            (Skip::Auto, None) => {
                let commas = Format { decimal_comma: true, ..format.clone() };
                let reader = CellReader { format: commas.clone(), ..CellReader::default() };
                ensure!(
                    format.decimal_comma || found_rows(&reader, &commas, &look).is_none(),
                    "no three rows of numbers with decimal points, expected some; with decimal commas there are: say --decimal-comma"
                );
                bail!(
                    "no three rows of as many numbers in the first {LOOK_LINES} lines, expected some: say --skip"
                )
            }
        };
        let separator = match (format.skip, &found) {
            (Skip::Auto, Some(found)) => found.separator,
            _ => separator(format.separator, skip, &look),
        };
        let mut lines = Lines::new(BufReader::new(File::open(path)?));
        for skipped in 0..skip {
            ensure!(lines.next()?.is_some(), "{skipped} lines, expected {skip} to skip, and rows");
        }
        let Some((number, line)) = next_filled(&mut lines)? else {
            bail!("empty, expected rows of numbers");
        };
        let line = line.to_owned();
        let mut cells = Cells::new(separator);
        cells.split(&line);
        let names: Vec<String> = cells.iter().map(|cell| plain(cell).into_owned()).collect();
        ensure!(
            names.len() <= MAX_COLUMNS,
            "line {number}: {} columns, expected at most {MAX_COLUMNS}",
            names.len()
        );
        (reader.days, reader.names) = (vec![Days::default(); names.len()], names);
        let wordy = |name: &String| !name.is_empty() && !reader.is_of_a_row(name);
        let has_names =
            format.header == Header::Yes || (format.header == Header::Auto && reader.names.iter().any(wordy));
        if has_names {
            let begins_later = |found: &FoundRows| found.begin > skip + 1 + usize::from(units_line);
            reader.hint = found.filter(begins_later).map(|found| found.hint()).unwrap_or_default();
            let mut units = Vec::new();
            if units_line && let Some((_, line)) = lines.next()? {
                cells.split(line);
                units = cells.iter().map(|cell| plain(cell).into_owned()).collect();
            }
            return Ok(Self { rows: RowLines { lines, cells, first: None, cut: None }, reader, units });
        }
        reader.names = (1..=reader.names.len()).map(|column| format!("c{column}")).collect();
        Ok(Self {
            rows: RowLines { lines, cells, first: Some((number, line)), cut: None },
            reader,
            units: Vec::new(),
        })
    }

    /// The lines, and what reads their cells.
    pub(crate) fn parts(&mut self) -> (&mut RowLines, &mut CellReader) {
        (&mut self.rows, &mut self.reader)
    }
}

impl Table for Separated {
    fn names(&self) -> &[String] {
        &self.reader.names
    }

    fn units(&self) -> &[String] {
        &self.units
    }

    fn place(&self) -> &'static str {
        "line"
    }

    fn hint(&self) -> &str {
        &self.reader.hint
    }

    fn cut(&self) -> Option<&CutLine> {
        self.rows.cut.as_ref()
    }

    fn says_missing(&self, place: usize) -> bool {
        self.reader.said.contains(&place)
    }

    fn each(&mut self, wanted: &[usize], take: &mut Take<'_>) -> anyhow::Result<()> {
        let (rows, reader) = self.parts();
        let mut values = vec![f64::NAN; wanted.len()];
        rows.each(&mut |line, row, cells| {
            for (value, &column) in values.iter_mut().zip(wanted) {
                *value = reader.number(cells, line, column)?;
            }
            take(line, row, &values)
        })
    }
}

impl RowLines {
    /// Hands over each line that holds a row, taken apart: the line's number, and the row's from 0.
    ///
    /// # Errors
    /// What the system says; a line that is too long; what `take` refuses.
    pub(crate) fn each(
        &mut self,
        take: &mut dyn FnMut(u64, usize, &Cells) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let mut row = 0;
        let mut shortest = usize::MAX;
        if let Some((number, line)) = self.first.take() {
            self.cells.split(&line);
            shortest = self.cells.iter().last().map_or(0, <[u8]>::len);
            take(number, row, &self.cells)?;
            row += 1;
        }
        while let Some((number, line)) = next_filled(&mut self.lines)? {
            self.cells.split(line);
            if self.cells.iter().all(<[u8]>::is_empty) {
                continue;
            }
            let last = self.cells.iter().last().unwrap_or_default();
            if !self.lines.has_end() && row >= ROWS_TO_COMPARE && last.len() < shortest {
                let cell = String::from_utf8_lossy(last).into_owned();
                self.cut = Some(CutLine { line: number, cell });
                continue;
            }
            shortest = shortest.min(last.len());
            take(number, row, &self.cells)?;
            row += 1;
        }
        Ok(())
    }
}

impl CellReader {
    /// The number in a column's cell, a time in seconds, NaN where it is missing.
    ///
    /// # Errors
    /// A line without that column, a cell that is no number; with line and column.
    pub(crate) fn number(&mut self, cells: &Cells, line: u64, column: usize) -> anyhow::Result<f64> {
        let text = self.text(cells, line, column)?;
        if !self.format.missing.is_empty() {
            let said = self.says_missing(&text, self.parsed(&text));
            self.said.extend(said);
        }
        if let Some(value) = self.value(&text) {
            return Ok(value);
        }
        match (self.time_s(&text), self.days.get_mut(column)) {
            (Some(time_s), Some(days)) => Ok(days.counted(time_s)),
            _ => {
                let name = self.names.get(column).map_or("", String::as_str);
                let (column, hint) = (column + 1, &self.hint);
                let format = self.format.time_format.as_ref();
                let or_a_time =
                    format.map_or(String::new(), |format| format!(" or a time of the format {format:?}"));
                Err(anyhow!(
                    "line {line}, column {column} ({name}): found {text:?}, expected a number{or_a_time}{hint}"
                ))
            }
        }
    }

    /// The text in a column's cell.
    ///
    /// # Errors
    /// A line without that column.
    pub(crate) fn text<'a>(
        &self,
        cells: &'a Cells,
        line: u64,
        column: usize,
    ) -> anyhow::Result<Cow<'a, str>> {
        let cell = cells.iter().nth(column).ok_or_else(|| {
            let (found, expected, hint) = (cells.iter().count(), self.names.len(), &self.hint);
            anyhow!("line {line}: {found} columns, expected {expected}{hint}")
        })?;
        Ok(plain(cell))
    }

    /// Whether a text can be a cell of a row: a number, a time, or a sample that is missing.
    fn is_of_a_row(&self, text: &str) -> bool {
        self.value(text).is_some() || self.time_s(text).is_some()
    }

    /// The date or time of day that a text is, s. A format's %.f is the decimal mark of the table.
    fn time_s(&self, text: &str) -> Option<f64> {
        let format = self.format.time_format.as_deref();
        let with_point =
            || self.format.decimal_comma.then(|| clock::seconds(&text.replace(',', "."), format)).flatten();
        clock::seconds(text, format).or_else(with_point)
    }

    /// The number that a text is; NaN where it says that a sample is missing.
    fn value(&self, text: &str) -> Option<f64> {
        let value = self.parsed(text);
        let is_missing = self.says_missing(text, value).is_some()
            || (value.is_none() && MISSING.iter().any(|missing| missing.eq_ignore_ascii_case(text)));
        if is_missing { Some(f64::NAN) } else { value }
    }

    /// The place in `format.missing` of what a text says; -9999 is -9999.00 too.
    fn says_missing(&self, text: &str, value: Option<f64>) -> Option<usize> {
        let same = |missing: &String| *missing == text || (value.is_some() && self.parsed(missing) == value);
        self.format.missing.iter().position(same)
    }

    fn parsed(&self, text: &str) -> Option<f64> {
        if self.format.decimal_comma { text.replace(',', ".").parse().ok() } else { text.parse().ok() }
    }
}

fn look(path: &Path) -> anyhow::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // A pipe would be read twice, and may never end.
    ensure!(std::fs::metadata(path)?.is_file(), "no regular file, expected one");
    File::open(path)?.take(LOOK_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Refuses what is no text, with what it seems to be.
fn text_only(look: &[u8]) -> anyhow::Result<()> {
    let starts = |magic: &[u8]| look.starts_with(magic);
    if starts(b"\x1f\x8b") || starts(b"PK\x03\x04") {
        bail!("not a text: compressed, or a spreadsheet; unpack it, or save it as CSV");
    }
    if starts(b"\xff\xfe") || starts(b"\xfe\xff") {
        bail!("not a text in UTF-8 but in UTF-16: save it as UTF-8");
    }
    if look.contains(&0) {
        bail!("not a text: it holds zero bytes; a MAT file's name ends in .mat, a NumPy array's in .npy");
    }
    Ok(())
}

fn separator(wanted: Separator, skip: usize, look: &[u8]) -> u8 {
    match wanted {
        Separator::Tab => b'\t',
        Separator::Semicolon => b';',
        Separator::Space => b' ',
        Separator::Comma => b',',
        Separator::Auto => {
            let mut lines = look.split(|byte| *byte == b'\n').skip(skip).map(line);
            let line = lines.find(|line| !is_no_row(line)).unwrap_or_default();
            [b'\t', b';', b','].into_iter().find(|byte| line.contains(byte)).unwrap_or(b' ')
        }
    }
}

fn line(line: &[u8]) -> &[u8] {
    line.strip_suffix(b"\r").unwrap_or(line)
}

/// Empty lines and remarks.
fn is_no_row(line: &[u8]) -> bool {
    line.is_empty() || line.starts_with(b"#")
}

fn next_filled(lines: &mut Lines<BufReader<File>>) -> anyhow::Result<Option<(u64, &[u8])>> {
    loop {
        match lines.next()? {
            None => return Ok(None),
            Some((_, line)) if is_no_row(line) => {}
            Some(_) => break,
        }
    }
    Ok(Some(lines.current()))
}

/// Where rows of numbers begin.
struct FoundRows {
    separator: u8,
    /// The first line of them, from 0.
    begin: usize,
    /// Lines before the names.
    skip: usize,
    units_line: bool,
}

impl FoundRows {
    fn hint(&self) -> String {
        let begin = self.begin + 1;
        format!("; rows of numbers begin in line {begin}: try --skip auto")
    }
}

/// Where three rows of as many numbers follow one another for the first time, whatever parts them unless that is said.
fn found_rows(reader: &CellReader, format: &Format, look: &[u8]) -> Option<FoundRows> {
    let lines: Vec<&[u8]> = look.split(|byte| *byte == b'\n').map(line).take(LOOK_LINES).collect();
    let separators: &[u8] = match format.separator {
        Separator::Auto => b"\t;, ",
        known => &[separator(known, 0, look)],
    };
    separators.iter().find_map(|separator| found_rows_parted(reader, &lines, *separator))
}

fn found_rows_parted(reader: &CellReader, lines: &[&[u8]], separator: u8) -> Option<FoundRows> {
    let mut cells = Cells::new(separator);
    let mut numbers = |line: &&[u8]| {
        cells.split(line);
        let is_of_a_row = |cell: &[u8]| reader.is_of_a_row(&plain(cell));
        let filled = cells.iter().filter(|cell| !cell.is_empty());
        let (all, count) = filled.fold((true, 0), |(all, count), cell| (all && is_of_a_row(cell), count + 1));
        (all && count > 1 && !is_no_row(line)).then(|| cells.iter().count())
    };
    let counts: Vec<Option<usize>> = lines.iter().map(&mut numbers).collect();
    let begin = counts.windows(3).position(|three| match three {
        [Some(one), Some(two), Some(three)] => one == two && two == three,
        _ => false,
    })?;
    let mut as_long = |up: usize| {
        let line = begin.checked_sub(up).and_then(|above| lines.get(above)).filter(|line| !is_no_row(line));
        line.is_some_and(|line| {
            cells.split(line);
            Some(cells.iter().count()) == counts.get(begin).copied().flatten()
        })
    };
    // Names alone, or names and units, or nothing.
    let above = (1..=2).take_while(|up| as_long(*up)).count();
    Some(FoundRows { separator, begin, skip: begin - above, units_line: above == 2 })
}

/// A cell as text, without a byte order mark and spaces around it.
fn plain(cell: &[u8]) -> Cow<'_, str> {
    match String::from_utf8_lossy(cell) {
        Cow::Borrowed(text) => Cow::Borrowed(text.trim_start_matches(BYTE_ORDER_MARK).trim()),
        Cow::Owned(text) => Cow::Owned(text.trim_start_matches(BYTE_ORDER_MARK).trim().to_owned()),
    }
}

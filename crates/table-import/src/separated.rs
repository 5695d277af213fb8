//! Text with separators (CSV and its kin), with or without a line of names.

use super::table::{Table, Take};
use anyhow::{Context, anyhow, bail};
use csv::{ByteRecord, Reader, ReaderBuilder};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// What stands between the cells of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Separator {
    /// Tabs, else semicolons, else commas, else spaces: whichever the first line holds
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Header {
    /// Where it holds anything that is no number
    Auto,
    /// It does
    Yes,
    /// It doesn't: columns are c1, c2, ...
    No,
}

/// How a text is read.
#[derive(Debug, Clone, Copy)]
pub struct Format {
    /// Between the cells.
    pub separator: Separator,
    /// Names in the first line.
    pub header: Header,
    /// 1,5 is one and a half.
    pub decimal_comma: bool,
}

/// So much of a file is looked at before it is read.
const LOOK_BYTES: u64 = 64 * 1024;
/// No table has more columns.
const MAX_COLUMNS: usize = 10_000;

/// An open text.
pub struct Separated {
    reader: Reader<File>,
    names: Vec<String>,
    /// The first line, where it holds numbers.
    first: Option<ByteRecord>,
    format: Format,
}

impl Separated {
    /// Opens a text and reads its first line.
    ///
    /// # Errors
    /// A file that can't be read, is no text, or is empty.
    pub fn open(path: &Path, mut format: Format) -> anyhow::Result<Self> {
        let file = path.display().to_string();
        let look = look(path).with_context(|| file.clone())?;
        if look.contains(&0) {
            bail!("{file}: not a text: it holds zero bytes; a MAT file's name ends in .mat");
        }
        format.separator = separator(format.separator, &look);
        let byte = match format.separator {
            Separator::Tab => b'\t',
            Separator::Semicolon => b';',
            Separator::Space => b' ',
            Separator::Comma | Separator::Auto => b',',
        };
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .delimiter(byte)
            .from_path(path)
            .with_context(|| file.clone())?;
        let mut first = ByteRecord::new();
        if !reader.read_byte_record(&mut first).with_context(|| file.clone())? {
            bail!("{file}: empty, expected rows of numbers");
        }
        let names: Vec<String> = cells(&first, format).map(|cell| plain(cell).trim().to_owned()).collect();
        if names.len() > MAX_COLUMNS {
            bail!("{file}, line 1: {} columns, expected at most {MAX_COLUMNS}", names.len());
        }
        let wordy =
            || names.iter().any(|name| !name.is_empty() && number(name, format.decimal_comma).is_none());
        if format.header == Header::Yes || (format.header == Header::Auto && wordy()) {
            return Ok(Self { reader, names, first: None, format });
        }
        let names = (1..=names.len()).map(|column| format!("c{column}")).collect();
        Ok(Self { reader, names, first: Some(first), format })
    }

    /// Reads one row's wanted cells into `values`.
    fn values(
        &self,
        record: &ByteRecord,
        line: u64,
        wanted: &[usize],
        values: &mut [f64],
    ) -> anyhow::Result<()> {
        let cells: Vec<&[u8]> = cells(record, self.format).collect();
        for (value, &column) in values.iter_mut().zip(wanted) {
            let name = self.names.get(column).map_or("", String::as_str);
            let place = || format!("line {line}, column {} ({name})", column + 1);
            let Some(cell) = cells.get(column) else {
                bail!("line {line}: {} columns, expected {}", cells.len(), self.names.len());
            };
            let text = plain(cell);
            *value = match text.trim() {
                "" => f64::NAN,
                text => number(text, self.format.decimal_comma)
                    .ok_or_else(|| anyhow!("{}: found {text:?}, expected a number", place()))?,
            };
        }
        Ok(())
    }
}

impl Table for Separated {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn each(&mut self, wanted: &[usize], take: &mut Take<'_>) -> anyhow::Result<()> {
        let mut values = vec![f64::NAN; wanted.len()];
        let mut record = ByteRecord::new();
        let mut row = 0;
        if let Some(first) = self.first.take() {
            let line = first.position().map_or(1, csv::Position::line);
            self.values(&first, line, wanted, &mut values)?;
            take(&|| format!("line {line}"), row, &values)?;
            row += 1;
        }
        while self.reader.read_byte_record(&mut record)? {
            let line = record.position().map_or(0, csv::Position::line);
            if cells(&record, self.format).all(<[u8]>::is_empty) {
                continue;
            }
            self.values(&record, line, wanted, &mut values)?;
            take(&|| format!("line {line}"), row, &values)?;
            row += 1;
        }
        Ok(())
    }
}

fn look(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(LOOK_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn separator(wanted: Separator, look: &[u8]) -> Separator {
    if wanted != Separator::Auto {
        return wanted;
    }
    let comment = |line: &&[u8]| line.is_empty() || line.starts_with(b"#") || *line == b"\r";
    let line = look.split(|byte| *byte == b'\n').find(|line| !comment(line)).unwrap_or_default();
    let kinds = [(b'\t', Separator::Tab), (b';', Separator::Semicolon), (b',', Separator::Comma)];
    let found = kinds.into_iter().find(|(byte, _)| line.contains(byte));
    found.map_or(Separator::Space, |(_, separator)| separator)
}

/// The cells of a line; between spaces, empty ones are none.
fn cells(record: &ByteRecord, format: Format) -> impl Iterator<Item = &[u8]> {
    record.iter().filter(move |cell| format.separator != Separator::Space || !cell.is_empty())
}

/// A cell as text, without a byte order mark.
fn plain(cell: &[u8]) -> String {
    String::from_utf8_lossy(cell).trim_start_matches('\u{feff}').to_owned()
}

fn number(text: &str, decimal_comma: bool) -> Option<f64> {
    if decimal_comma { text.replace(',', ".").parse().ok() } else { text.parse().ok() }
}

//! What a bench found: tables on the terminal, JSON for machines, and the documents' tables in their place.

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// A table with a name by which documents refer to it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Sheet {
    /// Its name in documents and JSON.
    pub id: String,
    /// What it shows, and what it was made with.
    pub title: String,
    /// The columns' names.
    pub header: Vec<String>,
    /// The rows.
    pub rows: Vec<Vec<String>>,
}

/// All that one bench found.
#[derive(Debug, Clone)]
pub struct Results {
    /// The bench's command.
    pub command: &'static str,
    /// Whether it was shortened.
    pub quick: bool,
    /// The machine, its kernel and governor, as they tell.
    pub machine: Vec<(String, String)>,
    /// The scheduling really obtained, in words.
    pub scheduling: String,
    /// Its tables.
    pub sheets: Vec<Sheet>,
    /// Its numbers.
    pub data: Value,
}

impl Sheet {
    /// An empty table.
    pub fn new(id: &str, title: impl Into<String>, header: &[&str]) -> Self {
        let header = header.iter().map(|name| (*name).to_owned()).collect();
        Self { id: id.to_owned(), title: title.into(), header, rows: Vec::new() }
    }

    /// Appends a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// The table on a page.
    pub fn table(&self) -> report::Table {
        report::Table { header: self.header.clone(), rows: self.rows.clone() }
    }

    /// The table in Markdown, its columns aligned.
    pub fn markdown(&self) -> String {
        let width = |column: usize| {
            let cells = self.rows.iter().chain([&self.header]).filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0).max(3)
        };
        let line = |row: &[String]| {
            let cells = row.iter().enumerate().map(|(column, cell)| {
                let padding = " ".repeat(width(column).saturating_sub(cell.chars().count()));
                if column == 0 { format!(" {cell}{padding} |") } else { format!(" {padding}{cell} |") }
            });
            format!("|{}\n", cells.collect::<String>())
        };
        let rule = (0..self.header.len()).map(|column| {
            let dashes = "-".repeat(width(column) + 1);
            if column == 0 { format!("{dashes}-|") } else { format!("{dashes}:|") }
        });
        let mut text = line(&self.header);
        text.push_str(&format!("|{}\n", rule.collect::<String>()));
        self.rows.iter().for_each(|row| text.push_str(&line(row)));
        text
    }
}

impl Results {
    /// For people.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for (name, value) in &self.machine {
            let _ = writeln!(text, "{name:20} {value}");
        }
        let _ = writeln!(text, "{:20} {}", "scheduling", self.scheduling);
        for sheet in &self.sheets {
            let _ = write!(text, "\n{}\n\n{}", sheet.title, sheet.markdown());
        }
        text
    }

    /// For machines.
    pub fn json(&self) -> Value {
        let machine: serde_json::Map<_, _> =
            self.machine.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
        json!({
            "format": "stepvalve-bench", "format_version": 1, "command": self.command, "quick": self.quick,
            "machine": machine, "scheduling": self.scheduling, "tables": self.sheets, "data": self.data,
        })
    }

    /// Writes `DIR/COMMAND.json`.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn write_json(&self, folder: &Path) -> Result<()> {
        let path = folder.join(format!("{}.json", self.command));
        std::fs::write(&path, serde_json::to_string_pretty(&self.json())? + "\n")
            .with_context(|| path.display().to_string())
    }

    /// Puts each table into `document`, between the comments that bear its name.
    ///
    /// # Errors
    /// Where a name is missing in the document, or the system refuses.
    pub fn put_into(&self, document: &Path) -> Result<()> {
        let mut text = std::fs::read_to_string(document).with_context(|| document.display().to_string())?;
        let mut sheets = self.sheets.clone();
        sheets.push(self.origin());
        for sheet in &sheets {
            text = replaced(&text, &sheet.id, &sheet.markdown())
                .with_context(|| document.display().to_string())?;
        }
        std::fs::write(document, text).with_context(|| document.display().to_string())
    }

    /// Where the numbers come from, as a table for documents.
    fn origin(&self) -> Sheet {
        let mut sheet = Sheet::new(&format!("{}-machine", self.command), "", &["machine", ""]);
        for (name, value) in self.machine.iter().filter(|(name, _)| name != "command_line") {
            let value = if name == "kernel" { without_its_builder(value) } else { value.clone() };
            sheet.row([name.clone(), value]);
        }
        sheet.row(["scheduling".to_owned(), self.scheduling.clone()]);
        sheet
    }
}

/// A kernel's version and configuration; by whom and with what it was built is nobody's business in a document.
fn without_its_builder(version: &str) -> String {
    let (name, rest) = version.split_once(" (").unwrap_or((version, ""));
    let configuration = rest.split_once('#').map_or(String::new(), |(_, tail)| format!(" #{tail}"));
    format!("{name}{configuration}")
}

/// The text with what stands between `<!-- bench ID -->` and `<!-- end -->` replaced.
fn replaced(text: &str, id: &str, table: &str) -> Result<String> {
    let begin = format!("<!-- bench {id} -->\n");
    let Some((before, rest)) = text.split_once(&begin) else { bail!("no line {}", begin.trim()) };
    let Some((_, after)) = rest.split_once("<!-- end -->") else {
        bail!("no <!-- end --> after {}", begin.trim())
    };
    Ok(format!("{before}{begin}{table}<!-- end -->{after}"))
}

/// A number with three significant digits.
pub fn digits(value: f64) -> String {
    if !value.is_finite() {
        return "unknown".to_owned();
    }
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    let decimals = usize::try_from((2 - magnitude).max(0)).unwrap_or(0);
    format!("{value:.decimals$}")
}

/// A time in µs from ns.
pub fn us(time_ns: u64) -> String {
    digits(time_ns as f64 / 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_go_where_the_document_wants_them() {
        let mut sheet = Sheet::new("a", "", &["what", "µs"]);
        sheet.row(["one".to_owned(), "1.5".to_owned()]);
        let text = "x\n<!-- bench a -->\nold\n<!-- end -->\ny\n";
        let new = replaced(text, "a", &sheet.markdown()).unwrap();
        assert_eq!(
            new,
            "x\n<!-- bench a -->\n| what |  µs |\n|------|----:|\n| one  | 1.5 |\n<!-- end -->\ny\n"
        );
        assert_eq!(replaced(&new, "a", &sheet.markdown()).unwrap(), new, "once more changes nothing");
        assert!(replaced(text, "b", "").is_err());
    }

    #[test]
    fn a_kernel_without_its_builder() {
        let version = "Linux version 6.1.0 (me@here) (gcc (GCC) 12, GNU ld) #1 SMP PREEMPT_RT";
        assert_eq!(without_its_builder(version), "Linux version 6.1.0 #1 SMP PREEMPT_RT");
        assert_eq!(without_its_builder("unknown"), "unknown");
    }

    #[test]
    fn three_digits() {
        assert_eq!([1234.6, 12.345, 0.012_345, 0.0].map(digits), ["1235", "12.3", "0.0123", "0.00"]);
    }
}

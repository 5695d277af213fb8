//! Tables of text.

use crate::html::escaped;

/// A number with its unit and its range is no longer.
const NUMBER_CHARS: usize = 40;
/// A cell that is longer holds a sentence.
const SENTENCE_CHARS: usize = 45;

/// More columns don't stand beside each other on a narrow screen.
const MANY_COLUMNS: usize = 5;

/// A table; columns of cells that begin with a number stand to the right. On a narrow screen a table with sentences in it, or with many
/// columns, becomes a list of its rows, each cell behind its column's name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// The columns' names; empty for none.
    pub header: Vec<String>,
    /// The rows.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub(crate) fn to_html(&self) -> String {
        let sentences = self.rows.iter().flatten().any(|text| text.chars().count() > SENTENCE_CHARS);
        let list = (sentences || self.header.len() > MANY_COLUMNS) && !self.header.is_empty();
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0).max(self.header.len());
        let numeric: Vec<bool> = (0..columns).map(|column| self.is_numeric(column)).collect();
        let mut html =
            format!("<div class=\"scroll\"><table{}>", if list { " class=\"as-list\"" } else { "" });
        if !self.header.is_empty() {
            html.push_str("<thead><tr>");
            for (name, number) in self.header.iter().zip(&numeric) {
                cell(&mut html, "th", name, *number);
            }
            html.push_str("</tr></thead>");
        }
        html.push_str("<tbody>");
        for row in &self.rows {
            html.push_str("<tr>");
            for (column, (text, number)) in row.iter().zip(&numeric).enumerate() {
                let name = self.header.get(column).filter(|_| list);
                labelled(&mut html, text, name, *number);
            }
            html.push_str("</tr>");
        }
        html.push_str("</tbody></table></div>");
        html
    }

    /// Whether a column holds numbers alone; words beside them would stand at two edges.
    fn is_numeric(&self, column: usize) -> bool {
        let mut cells = self.rows.iter().filter_map(|row| row.get(column)).peekable();
        cells.peek().is_some() && cells.all(|cell| is_number(cell))
    }
}

pub(crate) fn cell(html: &mut String, tag: &str, text: &str, number: bool) {
    let class = if number { " class=\"number\"" } else { "" };
    html.push_str(&format!("<{tag}{class}>{}</{tag}>", escaped(text)));
}

/// A cell that knows its column's name.
fn labelled(html: &mut String, text: &str, name: Option<&String>, number: bool) {
    let Some(name) = name else { return cell(html, "td", text, number) };
    let class = if number { " class=\"number\"" } else { "" };
    html.push_str(&format!("<td{class} data-name=\"{}\">{}</td>", escaped(name), escaped(text)));
}

pub(crate) fn is_number(text: &str) -> bool {
    let digits = text.trim_start_matches(['-', '−', '+', '±', '≤', '≥', '<', '>', '≈', ' ']);
    // Longer ones are sentences that begin with a number.
    let short = text.chars().count() <= NUMBER_CHARS;
    text == "–" || short && digits.starts_with(|c: char| c.is_ascii_digit())
}

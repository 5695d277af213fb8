//! Tables of text.

use crate::html::escaped;

/// A number with its unit and its range is no longer.
const NUMBER_CHARS: usize = 40;

/// A table; cells that begin with a number stand to the right.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// The columns' names; empty for none.
    pub header: Vec<String>,
    /// The rows.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub(crate) fn to_html(&self) -> String {
        let mut html = String::from("<div class=\"scroll\"><table>");
        if !self.header.is_empty() {
            let numeric = |column: usize| {
                let mut cells = self.rows.iter().filter_map(|row| row.get(column));
                self.rows.iter().any(|row| row.get(column).is_some()) && cells.all(|cell| is_number(cell))
            };
            html.push_str("<thead><tr>");
            for (column, name) in self.header.iter().enumerate() {
                cell(&mut html, "th", name, numeric(column));
            }
            html.push_str("</tr></thead>");
        }
        html.push_str("<tbody>");
        for row in &self.rows {
            html.push_str("<tr>");
            for text in row {
                cell(&mut html, "td", text, is_number(text));
            }
            html.push_str("</tr>");
        }
        html.push_str("</tbody></table></div>");
        html
    }
}

pub(crate) fn cell(html: &mut String, tag: &str, text: &str, number: bool) {
    let class = if number { " class=\"number\"" } else { "" };
    html.push_str(&format!("<{tag}{class}>{}</{tag}>", escaped(text)));
}

pub(crate) fn is_number(text: &str) -> bool {
    let digits = text.trim_start_matches(['-', '−', '+', '±', '≤', '≥', '<', '>', '≈', ' ']);
    // Longer ones are sentences that begin with a number.
    let short = text.chars().count() <= NUMBER_CHARS;
    text == "–" || short && digits.starts_with(|c: char| c.is_ascii_digit())
}

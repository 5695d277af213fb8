//! A table whose rows open: each has plots of its own, drawn when it is opened.

use crate::XyPlot;
use crate::html::escaped;
use crate::table::{cell, is_number};

/// A row, and what it opens.
#[derive(Debug, Clone, PartialEq)]
pub struct OpeningRow {
    /// Its cells; the first is what is clicked.
    pub cells: Vec<String>,
    /// What it opens.
    pub plots: Vec<XyPlot>,
}

/// A table whose rows open.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OpeningTable {
    /// The columns' names.
    pub header: Vec<String>,
    /// The rows.
    pub rows: Vec<OpeningRow>,
    /// How many of them are open at first.
    pub open: usize,
}

impl OpeningTable {
    /// `figure` writes a plot.
    pub(crate) fn write(&self, html: &mut String, figure: &dyn Fn(&mut String, &XyPlot)) {
        html.push_str("<div class=\"scroll\"><table class=\"opening\"><thead><tr>");
        for (column, name) in self.header.iter().enumerate() {
            // The first is a name, even one of digits.
            let number = |row: &OpeningRow| row.cells.get(column).is_some_and(|of| is_number(of));
            let numeric = column > 0 && self.rows.iter().all(number);
            cell(html, "th", name, numeric);
        }
        html.push_str("</tr></thead><tbody>");
        for (index, row) in self.rows.iter().enumerate() {
            self.row(html, row, index < self.open, figure);
        }
        html.push_str("</tbody></table></div>");
    }

    fn row(&self, html: &mut String, row: &OpeningRow, open: bool, figure: &dyn Fn(&mut String, &XyPlot)) {
        let (first, others) = row.cells.split_first().map_or(("", &[][..]), |(first, rest)| (first, rest));
        let name = escaped(first);
        html.push_str(&format!(
            "<tr class=\"opens\" data-name=\"{name}\"><td><button type=\"button\" aria-expanded=\"{open}\">{name}</button></td>"
        ));
        others.iter().for_each(|text| cell(html, "td", text, is_number(text)));
        let hidden = if open { "" } else { " hidden" };
        let columns = self.header.len().max(1);
        html.push_str(&format!(
            "</tr><tr class=\"opened\"{hidden}><td colspan=\"{columns}\"><div class=\"beside\">"
        ));
        row.plots.iter().for_each(|plot| figure(html, plot));
        html.push_str("</div></td></tr>");
    }
}

//! A page: title, one sentence, sections; and its HTML.

use crate::document::Document;
use crate::html::{escaped, script_data};
use crate::{Histogram, Linked, OpeningTable, Table, TimePlots, XyPlot};
use serde_json::Value;

/// In the order in which they build on each other.
const SCRIPTS: [&str; 6] = [
    include_str!("page/xy_plot.js"),
    include_str!("page/linked.js"),
    include_str!("page/opening_table.js"),
    include_str!("page/strips.js"),
    include_str!("page/time_plots.js"),
    include_str!("page/main.js"),
];

/// A self-contained page.
#[derive(Debug, Clone, Default)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// What it says, in one sentence.
    pub headline: String,
    /// Its sections.
    pub sections: Vec<Section>,
}

/// A part of a page under a heading.
#[derive(Debug, Clone, Default)]
pub struct Section {
    /// The heading; may be empty where the section is not folded.
    pub heading: String,
    /// Whether only the heading shows until it is clicked.
    pub folded: bool,
    /// What stands in it. Plots of x and y and histograms that follow on each other stand side by side where
    /// the window is wide enough.
    pub blocks: Vec<Block>,
}

/// A piece of a section.
#[derive(Debug, Clone)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// Text in lines as given, all letters of one width.
    Preformatted(String),
    /// Names and values, several beside each other.
    Facts(Vec<(String, String)>),
    /// A table.
    Table(Table),
    /// Signals over time.
    TimePlots(TimePlots),
    /// y over x.
    XyPlot(XyPlot),
    /// A table whose rows open.
    OpeningTable(OpeningTable),
    /// The same samples over several quantities.
    Linked(Box<Linked>),
    /// Distributions.
    Histogram(Histogram),
}

impl Section {
    /// An empty section.
    pub fn new(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), ..Self::default() }
    }

    /// An empty section that shows only its heading until it is clicked.
    pub fn folded(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), folded: true, blocks: Vec::new() }
    }

    /// The section with one more block.
    #[must_use]
    pub fn with(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }
}

impl Page {
    /// A page without sections.
    pub fn new(title: impl Into<String>, headline: impl Into<String>) -> Self {
        Self { title: title.into(), headline: headline.into(), sections: Vec::new() }
    }

    /// The page as one HTML document that needs nothing else.
    pub fn to_html(&self) -> String {
        let mut body = format!("<main>\n<header><h1>{}</h1>", escaped(&self.title));
        paragraph(&mut body, "headline", &self.headline);
        body.push_str(
            "<noscript><p>The plots need JavaScript, which is switched off.</p></noscript></header>\n",
        );
        self.sections.iter().for_each(|section| section.write(&mut body));
        body.push_str("</main>\n");
        // No network, not even by mistake.
        Document { title: &self.title, style: "", body: &body, scripts: &SCRIPTS, connect: "'none'" }
            .to_html()
    }
}

impl Section {
    fn write(&self, html: &mut String) {
        let heading = escaped(&self.heading);
        if self.folded {
            html.push_str(&format!("<details><summary>{heading}</summary>\n"));
        } else {
            html.push_str("<section>");
            if !heading.is_empty() {
                html.push_str(&format!("<h2>{heading}</h2>"));
            }
            html.push('\n');
        }
        let side_by_side = |block: &Block| matches!(block, Block::XyPlot(_) | Block::Histogram(_));
        for group in self.blocks.chunk_by(|a, b| side_by_side(a) && side_by_side(b)) {
            let beside = group.iter().any(side_by_side);
            html.push_str(if beside { "<div class=\"beside\">\n" } else { "" });
            group.iter().for_each(|block| block.write(html));
            html.push_str(if beside { "</div>\n" } else { "" });
        }
        html.push_str(if self.folded { "</details>\n" } else { "</section>\n" });
    }
}

impl Block {
    fn write(&self, html: &mut String) {
        match self {
            Self::Text(text) => paragraph(html, "", text),
            Self::Preformatted(text) => html.push_str(&format!("<pre>{}</pre>", escaped(text))),
            Self::Facts(facts) => write_facts(html, facts),
            Self::Table(table) => html.push_str(&table.to_html()),
            Self::TimePlots(plots) if plots.is_empty() => paragraph(html, "note", "No samples."),
            Self::TimePlots(plots) => write_plot(html, &plots.to_json(), &plots.describe(), None),
            Self::XyPlot(plot) => write_xy_plot(html, plot),
            Self::OpeningTable(table) => table.write(html, &write_xy_plot),
            Self::Linked(linked) => {
                let (json, notes) = linked.to_json();
                write_plot(html, &json, &notes, None);
            }
            Self::Histogram(histogram) => {
                write_plot(html, &histogram.to_json(), &[], Some(&histogram.quantiles()));
            }
        }
        html.push('\n');
    }
}

fn paragraph(html: &mut String, class: &str, text: &str) {
    if !text.is_empty() {
        let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
        html.push_str(&format!("<p{class}>{}</p>", escaped(text)));
    }
}

fn write_facts(html: &mut String, facts: &[(String, String)]) {
    html.push_str("<dl class=\"facts\">");
    for (name, value) in facts {
        html.push_str(&format!("<div><dt>{}</dt><dd>{}</dd></div>", escaped(name), escaped(value)));
    }
    html.push_str("</dl>");
}

fn write_xy_plot(html: &mut String, plot: &XyPlot) {
    let (json, notes) = plot.to_json();
    write_plot(html, &json, &notes, None);
}

/// A plot: its data, which the script draws, notes, and a table of its numbers.
fn write_plot(html: &mut String, data: &Value, notes: &[String], table: Option<&Table>) {
    html.push_str("<figure class=\"plot\"><script type=\"application/json\">");
    html.push_str(&script_data(data));
    html.push_str("</script>");
    if let Some(table) = table {
        html.push_str(&table.to_html());
    }
    notes.iter().for_each(|note| paragraph(html, "note", note));
    html.push_str("</figure>");
}

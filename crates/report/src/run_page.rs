//! The page of a run, `run.html`.

use crate::{Block, Histogram, Marker, Page, Panel, Section, Strip, Table, TimePlots};

/// Events that stand open; a longer list is folded away.
const MOST_OPEN: usize = 20;

/// What the page of a run shows. Whatever is empty is left out.
#[derive(Debug, Clone, Default)]
pub struct RunData {
    /// Name of the run.
    pub title: String,
    /// What came out, in one sentence.
    pub headline: String,
    /// Key figures, name and value with unit.
    pub summary: Vec<(String, String)>,
    /// States, limits and faults over time.
    pub strips: Vec<Strip>,
    /// Faults, set-points and operators' marks.
    pub markers: Vec<Marker>,
    /// The same moments and all that are too many to be marked, one a row.
    pub events: Table,
    /// The signals: angle, following error, torque, pulse rate, pressure and flow, latency.
    pub panels: Vec<Panel>,
    /// Timing of the processes.
    pub histograms: Vec<Histogram>,
    /// Facts about the machine and the program, name and value; folded away.
    pub machine: Vec<(String, String)>,
    /// Longer texts with their headings (the scenario, the models); folded away.
    pub texts: Vec<(String, String)>,
}

/// The page of a run: key figures, then all signals on one time axis, timing, and what the run was made from.
pub fn run_page(run: RunData) -> Page {
    let mut page = Page::new(run.title, run.headline);
    if !run.summary.is_empty() {
        page.sections.push(Section::new("").with(Block::Facts(run.summary)));
    }
    let plots = TimePlots { strips: run.strips, markers: run.markers, panels: run.panels };
    page.sections.push(Section::new("Signals").with(Block::TimePlots(plots)));
    if !run.events.rows.is_empty() {
        let many = run.events.rows.len() > MOST_OPEN;
        let section = if many { Section::folded("Events") } else { Section::new("Events") };
        page.sections.push(section.with(Block::Table(run.events)));
    }
    if !run.histograms.is_empty() {
        let mut timing = Section::new("Timing");
        timing.blocks.extend(run.histograms.into_iter().map(Block::Histogram));
        page.sections.push(timing);
    }
    if !run.machine.is_empty() {
        let rows = run.machine.into_iter().map(|(name, value)| vec![name, value]).collect();
        let table = Table { header: Vec::new(), rows };
        page.sections.push(Section::folded("Machine").with(Block::Table(table)));
    }
    for (heading, text) in run.texts {
        page.sections.push(Section::folded(heading).with(Block::Preformatted(text)));
    }
    page
}

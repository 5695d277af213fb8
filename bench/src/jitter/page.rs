//! The histograms of `bench jitter` as a page.

use super::measure::Measured;
use super::tables::label;
use crate::output::Results;
use crate::programs::LOOP;
use report::{Axis, Block, Histogram, Page, Section};

/// The page: how to read it, histograms by load and period, the tables, the machine.
pub fn page(results: &Results, all: &[Measured]) -> Page {
    let mut page = Page::new(
        "stepvalve: wake-up latency and execution time",
        "The loop beside cyclictest: the same core, priorities and offsets, in turns, in one run.",
    );
    page.sections.push(Section::new("How to read this").with(Block::Text(READING.to_owned())));
    page.sections.extend(all.iter().map(histograms));
    let mut tables = Section::folded("Tables");
    for sheet in &results.sheets {
        tables = tables.with(Block::Text(sheet.title.clone())).with(Block::Table(sheet.table()));
    }
    page.sections.push(tables);
    let mut machine = results.machine.clone();
    machine.push(("scheduling".to_owned(), results.scheduling.clone()));
    page.sections.push(Section::folded("The machine").with(Block::Facts(machine)));
    page
}

const READING: &str = "Each curve counts the cycles (logarithmic axis) that took a time (logarithmic too). Look at where \
    the bulk lies, then at the right end: a loop holds its period while the right end stays left of it. Where the \
    curves of stepvalve and cyclictest end alike, the machine made the end; where stepvalve's goes further right in all \
    turns, stepvalve did. The table of stalls says what took the core from everybody.";

fn histograms(measured: &Measured) -> Section {
    let mut section = Section::new(label(measured));
    for (index, (name, ours)) in LOOP.iter().zip(&measured.ours).enumerate() {
        let mut distributions = vec![ours.wake_up.distribution("stepvalve")];
        distributions
            .extend(measured.early.get(index).map(|early| early.wake_up.distribution("stepvalve, early")));
        distributions.extend(measured.peer_thread(index).map(|times| times.distribution("cyclictest")));
        let title = format!("{name}: wake-up after the deadline");
        section =
            section
                .with(Block::Histogram(Histogram { title, x: Axis::log("latency", "µs"), distributions }));
    }
    let distributions =
        LOOP.iter().zip(&measured.ours).map(|(name, ours)| ours.execution.distribution(name)).collect();
    let title = "Execution time of a cycle".to_owned();
    section.with(Block::Histogram(Histogram { title, x: Axis::log("execution time", "µs"), distributions }))
}

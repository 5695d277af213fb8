//! `stepvalve report`: a run file becomes a page with plots; `stepvalve compare`: two runs become one.

pub mod compare;

mod apart;
mod common_time;
mod differences;
mod events;
mod figures;
mod panels;
mod set_points;
mod strips;
mod table;
mod text;
mod timing;

use crate::files::{name, room_for, run_file};
use crate::pulse::Pulse;
use crate::say::say;
use crate::strangers::{self, Limits};
use ::report::{RunData, TimeAxis, run_page};
use anyhow::Context;
use run_log::RunFile;
use std::path::{Path, PathBuf};
use supervisor::{Failure, Outcome};
use table::Table;

/// What to show.
#[derive(clap::Args)]
pub struct Arguments {
    /// A run file, the folder of a run, or any valve-log
    #[arg(value_name = "run.h5")]
    run: PathBuf,
    /// The page to write
    #[arg(long, value_name = "run.html")]
    out: PathBuf,
    /// Replace the page that is there
    #[arg(long)]
    force: bool,
}

/// What to show, and what that may take.
#[derive(clap::Args)]
pub struct Limited {
    run: PathBuf,
    out: PathBuf,
    memory_bytes: u64,
    cpu_s: u64,
}

/// Has a process of its own write the page: the file may be anybody's.
///
/// # Errors
/// [`Failure::Input`] where the file can't be read or is no valve-log, or the output exists; [`Failure::Failed`]
/// where writing fails.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let (run, out) = (&run_file(&arguments.run)?, &arguments.out);
    room_for(out, arguments.force)?;
    let limits = Limits::of_work(run).with_context(|| name(run)).map_err(Failure::Input)?;
    let _pulse = Pulse::new(|| "drawing the page".to_owned());
    strangers::watched(run, "draw-page", &[run, out], &limits)?;
    Ok(Outcome::Done)
}

/// Writes the page within limits, in this process.
///
/// # Errors
/// As [`run`].
pub fn draw(arguments: &Limited) -> Result<Outcome, Failure> {
    let Limited { run, out, memory_bytes, cpu_s } = arguments;
    Limits { numbers: 0, memory_bytes: *memory_bytes, cpu_s: *cpu_s }.enforce()?;
    let run = data(run).map_err(Failure::Input)?;
    let headline = run.headline.clone();
    run_page(run).write_html(out).map_err(anyhow::Error::from)?;
    say(format_args!("{}: {headline}", name(out)));
    Ok(Outcome::Done)
}

/// Writes the page of a run file that this program has just made.
///
/// # Errors
/// Where the file can't be read or the page can't be written.
pub fn write(run_h5: &Path, out: &Path) -> Result<(), anyhow::Error> {
    Ok(run_page(data(run_h5)?).write_html(out)?)
}

/// All that the page shows. One column of the file is in memory at a time, beside the times.
fn data(path: &Path) -> Result<RunData, anyhow::Error> {
    let table = Table::open(path)?;
    let file = &table.file;
    let timing = timing::read(&table)?;
    let set_points = set_points::read(&table)?;
    let events = events::read(&table, &set_points)?;
    let figures = figures::Figures::gather(&table, &timing, &events)?;
    let plan = panels::plan(&table, &figures, &set_points)?;
    let series = plan.series() + timing.len() * timing::SERIES;
    let details = figures.details(&table);
    let axis = TimeAxis::new(&table.time_s, series, &details).with_context(|| name(path))?;
    let mut panels = plan.draw(&table, &|values| Ok(axis.trace(values)?))?;
    panels.extend(timing::panels(&timing, &axis)?);
    Ok(RunData {
        title: table.title(path)?,
        headline: figures.headline(&table, &events),
        summary: figures.facts(&table, &events)?,
        strips: strips::read(&table, &events, &timing)?,
        markers: events.markers(&table),
        events: events.table(&table),
        panels,
        histograms: timing::histograms(&timing)?,
        machine: machine(file, &timing)?,
        texts: texts(file)?,
    })
}

fn machine(file: &RunFile, timing: &[timing::ProcessTiming]) -> Result<Vec<(String, String)>, anyhow::Error> {
    let mut facts = Vec::new();
    facts.extend(file.text("program_version")?.map(|version| ("stepvalve".to_owned(), version)));
    facts.extend(timing.iter().map(|process| (process.name.clone(), process.scheduling.clone())));
    facts.extend(file.machine()?);
    Ok(facts)
}

fn texts(file: &RunFile) -> Result<Vec<(String, String)>, anyhow::Error> {
    let mut texts = Vec::new();
    let notes: Vec<_> = file.notes()?.into_iter().map(|note| note.text).collect();
    if !notes.is_empty() {
        texts.push(("Notes of the record".to_owned(), notes.join("\n")));
    }
    for (name, text) in file.texts()? {
        let heading = match name.as_str() {
            "scenario" => "Scenario",
            "truth" => "Model of the plant (truth)",
            _ => "Model of the controller (belief)",
        };
        texts.push((heading.to_owned(), text));
    }
    Ok(texts)
}

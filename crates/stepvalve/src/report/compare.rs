//! `stepvalve compare`: two runs, or any two valve-logs, on one page.

use super::apart::{Apart, apart};
use super::common_time::{Laid, common};
use super::differences::differences;
use super::table::Table;
use super::{events, figures, panels, set_points, strips, text, timing};
use crate::files::{name, room_for, run_file};
use crate::pulse::Pulse;
use crate::say::say;
use crate::strangers::{self, Limits};
use ::report::{Block, Level, Line, Marker, Page, Panel, Section, Strip, TimeAxis, TimePlots};
use anyhow::Context;
use std::path::{Path, PathBuf};
use supervisor::{Failure, Outcome};

/// The strips of a single run's page that are shown of both.
const STRIPS: [&str; 4] = ["state", "fault", "set-point", "limit"];
/// What the two are called.
const LETTERS: [&str; 2] = ["A", "B"];

/// What to show.
#[derive(clap::Args)]
pub struct Arguments {
    /// A run file, the folder of a run, or any valve-log
    #[arg(value_name = "A.h5")]
    a: PathBuf,
    /// Another
    #[arg(value_name = "B.h5")]
    b: PathBuf,
    /// The page to write
    #[arg(long, value_name = "compare.html")]
    out: PathBuf,
    /// Replace the page that is there
    #[arg(long)]
    force: bool,
}

/// What to show, and what that may take.
#[derive(clap::Args)]
pub struct Limited {
    a: PathBuf,
    b: PathBuf,
    out: PathBuf,
    memory_bytes: u64,
    cpu_s: u64,
}

/// Has a process of its own write the page: the files may be anybody's.
///
/// # Errors
/// [`Failure::Input`] where a file can't be read or is no valve-log, or the output exists; [`Failure::Failed`]
/// where writing fails.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let out = &arguments.out;
    room_for(out, arguments.force)?;
    let (a, b) = (run_file(&arguments.a)?, run_file(&arguments.b)?);
    let limits = |path: &Path| Limits::of_work(path).with_context(|| name(path)).map_err(Failure::Input);
    let limits = limits(&a)?.and(&limits(&b)?);
    let _pulse = Pulse::new(|| "drawing the page".to_owned());
    strangers::watched(&a, "draw-comparison", &[&a, &b, out], &limits)?;
    Ok(Outcome::Done)
}

/// Writes the page within limits, in this process.
///
/// # Errors
/// As [`run`].
pub fn draw(arguments: &Limited) -> Result<Outcome, Failure> {
    let Limited { a, b, out, memory_bytes, cpu_s } = arguments;
    Limits { numbers: 0, memory_bytes: *memory_bytes, cpu_s: *cpu_s }.enforce()?;
    let page = page(a, b).map_err(Failure::Input)?;
    page.write_html(out).map_err(anyhow::Error::from)?;
    say(format_args!("{}: {}", name(out), page.headline));
    Ok(Outcome::Done)
}

/// One of the two.
struct One {
    table: Table,
    title: String,
    timing: Vec<timing::ProcessTiming>,
    set_points: Vec<set_points::FollowedSetPoint>,
    events: events::Events,
    figures: figures::Figures,
    facts: Vec<(String, String)>,
    texts: Vec<(String, String)>,
}

impl One {
    fn open(path: &Path) -> Result<Self, anyhow::Error> {
        let table = Table::open(path)?;
        let timing = timing::read(&table)?;
        let set_points = set_points::read(&table)?;
        let events = events::read(&table, &set_points)?;
        let figures = figures::Figures::gather(&table, &timing, &events)?;
        let facts = figures.facts(&table, &events)?;
        let (title, texts) = (table.title(path)?, table.file.texts()?);
        Ok(Self { table, title, timing, set_points, events, figures, facts, texts })
    }

    fn strips(&self, letter: &str) -> Result<Vec<Strip>, anyhow::Error> {
        let mut strips = strips::read(&self.table, &self.events, &self.timing)?;
        strips.retain(|strip| STRIPS.contains(&strip.name.as_str()));
        strips.iter_mut().for_each(|strip| strip.name = format!("{letter} {}", strip.name));
        Ok(strips)
    }

    /// What failed; set-points stand in the strips.
    fn markers(&self, letter: &str) -> impl Iterator<Item = Marker> {
        let faults =
            self.events.markers(&self.table).into_iter().filter(|marker| marker.level >= Level::Attention);
        faults.map(move |marker| Marker { label: format!("{letter}: {}", marker.label), ..marker })
    }

    fn panels(
        &self,
        letter: &str,
        plan: &panels::Plan<'_>,
        laid: &Laid,
        axis: &TimeAxis,
    ) -> Result<Vec<Panel>, anyhow::Error> {
        let mut drawn = plan.draw(&self.table, &|values| {
            let own: Vec<f64> = values.collect();
            Ok(axis.trace(laid.values(&own))?)
        })?;
        let series = drawn.iter_mut().flat_map(|panel| &mut panel.series);
        series.for_each(|series| {
            series.name = format!("{letter} {}", series.name);
            // Where both agree A shows between B's dashes.
            if letter == LETTERS[1] && series.line == Line::Normal {
                series.line = Line::Dashed;
            }
        });
        Ok(drawn)
    }
}

fn page(a: &Path, b: &Path) -> Result<Page, anyhow::Error> {
    let open = |path: &Path| One::open(path).with_context(|| name(path));
    let both = [open(a)?, open(b)?];
    let [one, two] = &both;
    let (times, laid) = common(&one.table.time_s, &two.table.time_s);
    let apart = apart(&one.table, &two.table, times.len())?;
    let mut page = Page::new(format!("{} (A) and {} (B)", one.title, two.title), headline(one, two, &apart));
    let mut facts = facts([a, b], one, two);
    facts.rows.extend(apart.iter().map(|apart| apart.row(&times)));
    page.sections.push(Section::new("").with(Block::Table(facts)));
    page.sections
        .push(Section::new("Signals").with(Block::TimePlots(plots(one, two, &times, &laid, &apart)?)));
    let happened = events_of(one, two);
    if !happened.rows.is_empty() {
        page.sections.push(Section::new("Events").with(Block::Table(happened)));
    }
    page.sections.extend(changed(one, two));
    Ok(page)
}

/// Whose error is smaller, or how far the two are apart, in one sentence.
fn headline(a: &One, b: &One, apart: &[Apart]) -> String {
    let error = |one: &One| one.figures.true_error.or(one.figures.error);
    let (Some(of_a), Some(of_b)) = (error(a), error(b)) else {
        if let Some(apart) = apart.first() {
            return apart.headline();
        }
        let rows = |one: &One| text::grouped(one.figures.rows as u64);
        return format!("{} samples of A and {} of B.", rows(a), rows(b));
    };
    format!(
        "Following error: {} RMS in A, {} in B; {} and {} at the peak.",
        text::degrees(of_a.rms),
        text::degrees(of_b.rms),
        text::degrees(of_a.peak),
        text::degrees(of_b.peak)
    )
}

/// The key figures beside each other.
fn facts(paths: [&Path; 2], a: &One, b: &One) -> ::report::Table {
    let value = |one: &One, what: &str| {
        let found = one.facts.iter().find(|(name, _)| name == what);
        found.map_or_else(|| "–".to_owned(), |(_, value)| value.clone())
    };
    let mut names: Vec<&String> = a.facts.iter().map(|(name, _)| name).collect();
    names.extend(
        b.facts.iter().map(|(name, _)| name).filter(|name| !a.facts.iter().any(|(of_a, _)| of_a == *name)),
    );
    let file = vec!["File".to_owned(), name(paths[0]), name(paths[1])];
    let rows = names.into_iter().map(|what| vec![what.clone(), value(a, what), value(b, what)]);
    let header = ["", "A", "B"].map(str::to_owned).to_vec();
    ::report::Table { header, rows: std::iter::once(file).chain(rows).collect() }
}

fn plots(
    a: &One,
    b: &One,
    times: &[f64],
    laid: &[Laid; 2],
    apart: &[Apart],
) -> Result<TimePlots, anyhow::Error> {
    let mut plan_a = panels::plan(&a.table, &a.figures, &a.set_points)?;
    let mut plan_b = panels::plan(&b.table, &b.figures, &b.set_points)?;
    plan_a.share_unit(&mut plan_b);
    let details: Vec<_> = [a, b].iter().flat_map(|one| one.figures.details(&one.table)).collect();
    let axis = TimeAxis::new(times, plan_a.series() + plan_b.series() + apart.len(), &details)?;
    let mut plots = TimePlots::default();
    for (((letter, one), plan), laid) in LETTERS.into_iter().zip([a, b]).zip([plan_a, plan_b]).zip(laid) {
        plots.strips.extend(one.strips(letter)?);
        plots.markers.extend(one.markers(letter));
        for panel in one.panels(letter, &plan, laid, &axis)? {
            match plots.panels.iter_mut().find(|there| there.title == panel.title) {
                Some(there) => there.series.extend(panel.series),
                None => plots.panels.push(panel),
            }
        }
    }
    for apart in apart {
        plots.panels.push(apart.panel(&axis)?);
    }
    Ok(plots)
}

/// What happened to each, A's before B's.
fn events_of(a: &One, b: &One) -> ::report::Table {
    let of = |(letter, one): (&str, &One)| {
        let rows = one.events.table(&one.table).rows.into_iter();
        rows.map(|row| std::iter::once(letter.to_owned()).chain(row).collect()).collect::<Vec<_>>()
    };
    let header = ["", "time", "what", ""].map(str::to_owned).to_vec();
    ::report::Table { header, rows: LETTERS.into_iter().zip([a, b]).flat_map(of).collect() }
}

/// What the two were made from, where it differs.
fn changed(a: &One, b: &One) -> Option<Section> {
    if a.texts.is_empty() || b.texts.is_empty() {
        return None;
    }
    let differ = differences(&a.texts, &b.texts);
    let section = Section::new("What differs in scenario and models");
    if differ.is_empty() {
        return Some(section.with(Block::Text("Nothing: both were made from the same texts.".to_owned())));
    }
    let blocks = differ.into_iter().flat_map(|(name, lines)| {
        [Block::Text(format!("Lines of the {name} that only one of them has:")), Block::Preformatted(lines)]
    });
    Some(blocks.fold(section, Section::with))
}

//! Of the report: all runs in a table, the worst first; each opens what was measured and predicted.

use diagnosis::{Found, Shown};
use log_data::{Channel, Log, Run};
use report::{Axis, Band, Block, Hue, OpeningRow, OpeningTable, Section, Style, XyPlot, XySeries};
use study::words::{self, is_changed, short, unit};
use study::{Residuals, Sampled};

/// Rows of samples that the page holds, of all runs together, and of one run at least and at most.
const ALL_ROWS: usize = 40_000;
const LEAST_ROWS: usize = 200;
const MOST_ROWS: usize = 2_000;
/// The most runs that open; further ones stand in the table alone.
const MOST_RUNS: usize = 150;
/// A run of which this part was looked at in one way was looked at whole.
const WHOLE: f64 = 0.98;

/// The section.
pub fn section(found: &Found, log: &Log, residuals: &Residuals) -> Section {
    let changed = is_changed(found);
    let mut order: Vec<(f64, usize)> =
        residuals.runs.iter().enumerate().map(|(index, run)| (run.rms(changed), index)).collect();
    // Runs that nothing is known of come last.
    order.sort_by(|a, b| b.0.is_finite().cmp(&a.0.is_finite()).then(b.0.total_cmp(&a.0)));
    let kinds = log.runs.iter().any(|run| !run.kind.is_empty());
    let rows = (ALL_ROWS / log.runs.len().max(1)).clamp(LEAST_ROWS, MOST_ROWS);
    let row = |(place, (_, index)): (usize, &(f64, usize))| {
        let (run, sampled) = (log.runs.get(*index)?, residuals.runs.get(*index)?);
        let blocks = blocks(found, run);
        let plots = if place < MOST_RUNS { plots(found, run, sampled, &blocks, rows) } else { Vec::new() };
        Some(OpeningRow { cells: cells(found, run, sampled, (&blocks, kinds)), plots })
    };
    let unit = unit(found.channel);
    // The errors first: on a narrow screen the rest lies beyond its edge.
    let mut header = vec!["run".to_owned(), format!("error of the {}, {unit}", words::GIVEN)];
    if changed {
        header.push(format!("error of the {}, {unit}", words::changed(found)));
    }
    let further = ["times the noise", "used", "kind", "length, s", "samples"];
    header.extend(further.into_iter().filter(|of| kinds || *of != "kind").map(str::to_owned));
    let table = OpeningTable { header, rows: order.iter().enumerate().filter_map(row).collect(), open: 1 };
    let taken_off = if found.taken_off {
        " Each run's zero and the hum, which the numbers above are without, are still in these errors: the models know of neither."
    } else {
        ""
    };
    Section::new("Measured and simulated")
        .with(Block::Text(format!(
            "All runs, the worst first. A click opens what was measured and what the models predict from the run's beginning. \
             \"Kept aside\" means that the model was not fitted to it.{taken_off}"
        )))
        .with(Block::OpeningTable(table))
}

fn cells(found: &Found, run: &Run, sampled: &Sampled, (blocks, kinds): (&[Band], bool)) -> Vec<String> {
    let changed = is_changed(found);
    let noise = found.diagnosis.residual.first().map_or(f64::NAN, |residual| residual.noise);
    let error = sampled.rms(changed);
    let mut cells = vec![run.name.clone(), short(sampled.rms(false))];
    if changed {
        cells.push(short(error));
    }
    cells.push(if noise > 0.0 { format!("{:.1}", error / noise) } else { "–".to_owned() });
    cells.push(used(run, blocks));
    cells.extend(kinds.then(|| run.kind.clone()));
    cells.extend([short(run.end_s() - run.start_s()), run.len().to_string()]);
    cells
}

/// What of a run the diagnosis looked at, and how.
fn used(run: &Run, blocks: &[Band]) -> String {
    let part = |label: &str| {
        let of = blocks.iter().filter(|block| block.label == label);
        of.map(|block| block.to - block.from).sum::<f64>() / (run.end_s() - run.start_s())
    };
    let (fitted, aside) = (part(FITTED), part(KEPT_ASIDE));
    match (fitted > 0.0, aside > 0.0) {
        (false, false) => "not looked at".to_owned(),
        (true, false) if fitted > WHOLE => FITTED.to_owned(),
        (false, true) if aside > WHOLE => KEPT_ASIDE.to_owned(),
        (true, false) => format!("{FITTED}, {:.0}\u{a0}% of it", 100.0 * fitted),
        (false, true) => format!("{KEPT_ASIDE}, {:.0}\u{a0}% of it", 100.0 * aside),
        (true, true) => {
            format!("{FITTED} {:.0}\u{a0}%, {KEPT_ASIDE} {:.0}\u{a0}%", 100.0 * fitted, 100.0 * aside)
        }
    }
}

const FITTED: &str = "fitted";
const KEPT_ASIDE: &str = "kept aside";

/// The blocks of a run that the diagnosis looked at, by time on the run's clock.
fn blocks(found: &Found, run: &Run) -> Vec<Band> {
    let begin = run.start_s();
    let interval_s = (run.end_s() - begin) / run.len().saturating_sub(1).max(1) as f64;
    let mut pieces: Vec<&Shown> = found.shown.iter().filter(|shown| shown.name == run.name).collect();
    let first = |shown: &&Shown| shown.time_s.first().copied().unwrap_or(f64::NAN);
    pieces.sort_by(|a, b| first(a).total_cmp(&first(b)));
    let mut blocks: Vec<Band> = Vec::new();
    for shown in pieces {
        let (Some(from), Some(to)) = (shown.time_s.first(), shown.time_s.last()) else { continue };
        let (from, to) = (from - begin, to - begin);
        let label = if shown.held_out { KEPT_ASIDE } else { FITTED };
        match blocks.last_mut() {
            // Blocks that follow on each other, a sample apart, are one.
            Some(last) if last.label == label && from <= last.to + 3.0 * interval_s => last.to = to,
            _ => blocks.push(Band { from, to, label: label.to_owned() }),
        }
    }
    blocks
}

fn plots(found: &Found, run: &Run, sampled: &Sampled, blocks: &[Band], rows: usize) -> Vec<XyPlot> {
    let begin = run.start_s();
    let kept = kept(sampled, rows);
    let over_time = |value: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
        kept.iter()
            .map(|row| (run.time_s.get(*row).map_or(f64::NAN, |time_s| time_s - begin), value(*row)))
            .collect()
    };
    let at = |values: &[f64], row: usize| values.get(row).copied().unwrap_or(f64::NAN);
    // Of an angle the lag behind the command is what friction makes.
    let command = run.angle_command_rad.as_deref().filter(|_| found.channel == Channel::Angle);
    let less = |row: usize| command.map_or(0.0, |command| at(command, row));
    let line = |name: &str, hue, points| XySeries { name: name.to_owned(), style: Style::Line, hue, points };
    let mut values = vec![XySeries {
        style: Style::Points,
        ..line("measured", Hue::Measured, over_time(&|row| at(&sampled.measured, row) - less(row)))
    }];
    values.push(line(words::GIVEN, Hue::Given, over_time(&|row| at(&sampled.before, row) - less(row))));
    let error = |model: &[f64], row: usize| at(&sampled.measured, row) - at(model, row);
    let mut errors = vec![line(words::GIVEN, Hue::Given, over_time(&|row| error(&sampled.before, row)))];
    if is_changed(found) {
        values.push(line(
            words::changed(found),
            Hue::Extended,
            over_time(&|row| at(&sampled.after, row) - less(row)),
        ));
        errors.push(line(words::changed(found), Hue::Extended, over_time(&|row| error(&sampled.after, row))));
    }
    let limit = |sign: f64| over_time(&|row| 2.0 * sign * at(&sampled.deviation, row));
    // Two lines, a gap between them.
    let limits = [limit(1.0), vec![(f64::NAN, f64::NAN)], limit(-1.0)].concat();
    errors.push(line("two standard deviations, were the model right", Hue::Noise, limits));
    let quantity = if command.is_some() { "angle less command" } else { found.channel.name() };
    let whole = |band: &Band| band.to - band.from > WHOLE * (run.end_s() - begin);
    let bands = if blocks.iter().any(whole) { Vec::new() } else { blocks.to_vec() };
    let plot = |title: String, label: &str, series| XyPlot {
        title,
        x: Axis::new("time in the run", "s"),
        y: Axis::new(label, unit(found.channel)),
        series,
        bands: bands.clone(),
    };
    vec![
        plot(format!("{}: {quantity}", run.name), quantity, values),
        plot(format!("{}: error", run.name), "measured less simulated", errors),
    ]
}

/// The rows to show: of each stretch those with the least and the greatest error and measurement, so that nothing that stands out is lost.
fn kept(sampled: &Sampled, most: usize) -> Vec<usize> {
    let rows = sampled.measured.len();
    if rows <= most {
        return (0..rows).collect();
    }
    let stretch = (4 * rows).div_ceil(most);
    let mut kept = Vec::new();
    let error = |row: usize| Some(sampled.measured.get(row)? - sampled.after.get(row)?);
    let measured = |row: usize| sampled.measured.get(row).copied();
    for from in (0..rows).step_by(stretch) {
        let part = || from..(from + stretch).min(rows);
        for of in [&error as &dyn Fn(usize) -> Option<f64>, &measured] {
            let known = || part().filter_map(|row| Some((row, of(row).filter(|value| value.is_finite())?)));
            kept.extend(known().min_by(|a, b| a.1.total_cmp(&b.1)).map(|found| found.0));
            kept.extend(known().max_by(|a, b| a.1.total_cmp(&b.1)).map(|found| found.0));
        }
    }
    kept.sort_unstable();
    kept.dedup();
    kept
}

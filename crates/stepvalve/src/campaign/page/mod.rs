//! The page of a campaign: how its runs came out, which were the worst, and what decided it.

mod influences;

use super::keep::worst;
use super::row_file::TABLE;
use ::campaign::{Campaign, Metric, Row};
use influences::sections;
use log_data::quantile;
use report::{Axis, Block, Hue, Page, Section, Style, Table, XyPlot, XySeries};
use std::collections::BTreeMap;
use std::path::Path;

/// So many of the worst runs are listed.
const WORST: usize = 10;
/// So many reasons of failed runs are listed.
const REASONS: usize = 10;
/// The parts of a distribution that its table names.
const QUANTILES: [(&str, f64); 5] =
    [("least", 0.0), ("5 %", 0.05), ("median", 0.5), ("95 %", 0.95), ("largest", 1.0)];

/// The page of all rows, which are in the order of their runs, and were made by this version of the program.
pub fn page(campaign: &Campaign, version: &str, rows: &[Row]) -> Page {
    let mut page = Page::new(campaign.plan().name.clone(), headline(rows));
    page.sections.push(Section::new("").with(Block::Facts(facts(campaign, version, rows))));
    page.sections.extend(failures(rows));
    if campaign.plan().task.measures() {
        page.sections.push(distributions(campaign, rows));
    }
    if campaign.plan().task.diagnoses() {
        page.sections.push(diagnoses(rows));
    }
    page.sections.push(worst_runs(campaign, rows));
    page.sections.extend(sections(campaign, rows));
    page.sections.push(texts(campaign));
    page
}

/// The campaign in a sentence.
pub fn headline(rows: &[Row]) -> String {
    let count = |is: &dyn Fn(&Row) -> bool| rows.iter().filter(|row| is(row)).count();
    let motion = |row: &Row, is: fn(&::campaign::MotionMetrics) -> bool| row.motion.as_ref().is_some_and(is);
    let faults = count(&|row| motion(row, |motion| motion.fault != 0));
    let lost = count(&|row| motion(row, |motion| motion.lost_steps > 0));
    let failed = count(&|row| row.failure.is_some());
    let mut said = vec![plural(rows.len(), "run", "runs")];
    let notable =
        [(faults, "stopped by a fault"), (lost, "with lost steps"), (failed, "that failed by themselves")];
    said.extend(
        notable.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")),
    );
    if said.len() == 1 {
        said.push("none stopped by a fault, none with lost steps".to_owned());
    }
    said.join(", ")
}

fn plural(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// A run's outcome in a few words.
pub fn how_bad(row: &Row) -> String {
    match (&row.failure, &row.motion) {
        (Some(failure), _) => format!("{}: {}", failure.stage.name(), failure.reason),
        (None, Some(motion)) => {
            let error = format!("following error RMS {}°", short(motion.error_rms_rad.to_degrees()));
            match (motion.fault_name(), motion.lost_steps) {
                ("", 0) => error,
                ("", lost) => format!("{}, {error}", plural(lost as usize, "step lost", "steps lost")),
                (fault, _) => format!("fault {fault}, {error}"),
            }
        }
        (None, None) => row.diagnosed.as_ref().map_or_else(
            || "not measured".to_owned(),
            |found| {
                format!("{}, belief off by {}°", found.verdict, short(found.residual_rms_rad.to_degrees()))
            },
        ),
    }
}

/// Four significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value.is_finite() { "0".to_owned() } else { "–".to_owned() };
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..7.0).contains(&magnitude) {
        return format!("{value:.3e}");
    }
    let decimals = (3.0 - magnitude).max(0.0) as usize;
    format!("{value:.decimals$}")
}

/// A metric's value as the page shows it: angles in degrees.
fn shown(metric: Metric, value: f64) -> f64 {
    if metric.unit() == "rad" { value.to_degrees() } else { value }
}

fn unit(metric: Metric) -> &'static str {
    match metric.unit() {
        "rad" => "°",
        "N*m" => "N·m",
        "1" => "",
        other => other,
    }
}

fn facts(campaign: &Campaign, version: &str, rows: &[Row]) -> Vec<(String, String)> {
    let plan = campaign.plan();
    let scenarios: Vec<String> = campaign.bases().map(|base| label(campaign, &base.scenario.file)).collect();
    let kind = match plan.design.kind {
        config::DesignKind::Grid => "grid",
        config::DesignKind::LatinHypercube => "Latin hypercube",
        config::DesignKind::Sobol => "Sobol sequence",
        config::DesignKind::Random => "random",
    };
    let is_grid = plan.design.kind == config::DesignKind::Grid;
    let design = if is_grid { kind.to_owned() } else { format!("{kind}, seed {}", plan.design.seed) };
    let fact = |name: &str, value: String| (name.to_owned(), value);
    vec![
        fact("runs", rows.len().to_string()),
        fact(if scenarios.len() == 1 { "scenario" } else { "scenarios" }, scenarios.join(", ")),
        fact("design", design),
        fact("varied", plural(plan.vary.len(), "quantity", "quantities")),
        fact("plan", campaign.source().file.clone()),
        fact("stepvalve", version.to_owned()),
        fact("all rows", TABLE.to_owned()),
    ]
}

/// Runs that failed by themselves, by their reasons; `None` where none did.
fn failures(rows: &[Row]) -> Option<Section> {
    let failed: Vec<(u64, &::campaign::Failure)> =
        rows.iter().filter_map(|row| Some((row.run, row.failure.as_ref()?))).collect();
    if failed.is_empty() {
        return None;
    }
    let listed = failed.iter().take(REASONS);
    let rows = listed
        .map(|(run, failure)| vec![run.to_string(), failure.stage.name().to_owned(), failure.reason.clone()])
        .collect();
    let header = ["run", "outcome", "reason"].map(str::to_owned).to_vec();
    let mut section =
        Section::new("Runs that failed by themselves").with(Block::Table(Table { header, rows }));
    if failed.len() > REASONS {
        let more = failed.len() - REASONS;
        section = section.with(Block::Text(format!("{more} more are in {TABLE}, column outcome.")));
    }
    Some(section)
}

/// A scenario's file without folder and ending, where no other is called so.
fn label(campaign: &Campaign, file: &str) -> String {
    let stem = |file: &str| Path::new(file).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let alike = campaign.bases().filter(|base| stem(&base.scenario.file) == stem(file)).count();
    stem(file).filter(|_| alike == 1).unwrap_or_else(|| file.to_owned())
}

/// What is varied, by the last part of its path, where no other has that.
fn short_paths(campaign: &Campaign) -> Vec<String> {
    let vary = &campaign.plan().vary;
    let last = |path: &str| path.rsplit('.').next().unwrap_or_default().to_owned();
    let alike = |path: &str| vary.iter().filter(|other| last(&other.path.text) == last(path)).count();
    let short = |of: &config::Vary| {
        let path = &of.path.text;
        let name = if alike(path) == 1 { last(path) } else { path.clone() };
        if of.is_factor { format!("{name} (factor)") } else { name }
    };
    vary.iter().map(short).collect()
}

/// Rows of each scenario, in the plan's order.
fn by_scenario<'r>(campaign: &Campaign, rows: &'r [Row]) -> Vec<(String, Vec<&'r Row>)> {
    let of = |scenario: &str| {
        rows.iter().filter(|row| campaign.scenario(row.run) == scenario).collect::<Vec<&Row>>()
    };
    campaign.bases().map(|base| (label(campaign, &base.scenario.file), of(&base.scenario.file))).collect()
}

/// The values of a metric, least first, as the page shows them.
fn sorted(metric: Metric, rows: &[&Row]) -> Vec<f64> {
    let values = rows.iter().map(|row| shown(metric, metric.of(row)));
    let mut known: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    known.sort_by(f64::total_cmp);
    known
}

fn distributions(campaign: &Campaign, rows: &[Row]) -> Section {
    let groups = by_scenario(campaign, rows);
    let mut section = Section::new("Distributions");
    let mut header = vec!["metric".to_owned()];
    if groups.len() > 1 {
        header.push("scenario".to_owned());
    }
    header.push("runs".to_owned());
    header.extend(QUANTILES.iter().map(|(name, _)| (*name).to_owned()));
    let mut table = Table { header, rows: Vec::new() };
    let mut plots = Vec::new();
    for metric in Metric::ALL {
        let values: Vec<(&str, Vec<f64>)> =
            groups.iter().map(|(name, rows)| (name.as_str(), sorted(metric, rows))).collect();
        table
            .rows
            .extend(values.iter().map(|(name, values)| quantiles(metric, groups.len() > 1, name, values)));
        let differ = values.iter().any(|(_, values)| values.first() != values.last());
        if differ {
            plots.push(cumulative(metric, &values));
        }
    }
    section = section.with(Block::Table(table)).with(Block::Text(
        "Each curve says in which share of the runs the metric is at most so large.".to_owned(),
    ));
    plots.into_iter().fold(section, |section, plot| section.with(Block::XyPlot(plot)))
}

fn quantiles(metric: Metric, several: bool, scenario: &str, values: &[f64]) -> Vec<String> {
    let unit = unit(metric);
    let label = metric.label();
    let mut row = vec![if unit.is_empty() { label.to_owned() } else { format!("{label}, {unit}") }];
    if several {
        row.push(scenario.to_owned());
    }
    row.push(values.len().to_string());
    row.extend(QUANTILES.iter().map(|(_, part)| quantile(values, *part).map_or("–".to_owned(), short)));
    row
}

/// The share of runs with at most so much, as steps.
fn cumulative(metric: Metric, values: &[(&str, Vec<f64>)]) -> XyPlot {
    let steps = |values: &[f64]| -> Vec<(f64, f64)> {
        let share = |count: usize| 100.0 * count as f64 / values.len() as f64;
        let step = |(index, value): (usize, &f64)| [(*value, share(index)), (*value, share(index + 1))];
        values.iter().enumerate().flat_map(step).collect()
    };
    XyPlot {
        title: metric.label().to_owned(),
        x: Axis::new(metric.label(), unit(metric)),
        y: Axis::new("share of the runs", "%"),
        series: values
            .iter()
            .map(|(name, values)| XySeries {
                name: (*name).to_owned(),
                style: Style::Line,
                hue: Hue::ByPlace,
                points: steps(values),
            })
            .collect(),
        bands: Vec::new(),
    }
}

fn diagnoses(rows: &[Row]) -> Section {
    let found = || rows.iter().filter_map(|row| row.diagnosed.as_ref());
    let mut verdicts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut causes: BTreeMap<&str, usize> = BTreeMap::new();
    for diagnosed in found() {
        *verdicts.entry(&diagnosed.verdict).or_default() += 1;
        for cause in &diagnosed.causes {
            *causes.entry(cause).or_default() += 1;
        }
    }
    let of = found().count().max(1);
    let table = |what: &str, counts: &BTreeMap<&str, usize>| {
        let mut sorted: Vec<(&&str, &usize)> = counts.iter().collect();
        sorted.sort_by(|a, b| b.1.cmp(a.1));
        let row = |(name, count): (&&str, &usize)| {
            vec![(*name).to_owned(), count.to_string(), format!("{:.0} %", 100.0 * *count as f64 / of as f64)]
        };
        let header = [what, "runs", "share"].map(str::to_owned).to_vec();
        Block::Table(Table { header, rows: sorted.into_iter().map(row).collect() })
    };
    let mut section = Section::new("Diagnoses")
        .with(Block::Text("What the belief gets wrong about each run's record.".to_owned()))
        .with(table("verdict", &verdicts));
    if !causes.is_empty() {
        section = section.with(table("accepted cause", &causes));
    }
    section
}

fn worst_runs(campaign: &Campaign, rows: &[Row]) -> Section {
    let several = campaign.bases().count() > 1;
    let mut header = vec!["run".to_owned()];
    if several {
        header.push("scenario".to_owned());
    }
    // In front: behind a plan of many parameters it would be out of sight.
    header.push("what became of it".to_owned());
    header.extend(short_paths(campaign));
    let row = |row: &Row| {
        let mut cells = vec![row.run.to_string()];
        if several {
            cells.push(label(campaign, campaign.scenario(row.run)));
        }
        cells.push(how_bad(row));
        cells.extend(campaign.settings(row.run).iter().map(setting));
        cells
    };
    let plan = quoted(&campaign.source().file);
    let command = |row: &&Row| format!("stepvalve campaign {plan} --only {0} --out run-{0:05}", row.run);
    // Those that failed by themselves have a section of their own, and would hide all others.
    let worst = worst(rows.iter().filter(|row| row.failure.is_none()), WORST);
    let commands: Vec<String> = worst.iter().map(command).collect();
    let rows = worst.into_iter().map(row).collect();
    let order = if campaign.plan().task.measures() {
        "First faults, then lost steps, then the largest following errors."
    } else {
        "Those first whose record the belief predicts worst."
    };
    Section::new("The worst runs")
        .with(Block::Text(order.to_owned()))
        .with(Block::Table(Table { header, rows }))
        .with(Block::Text(
            "Each of them again, recorded as stepvalve simulate does, with a page of its own:".to_owned(),
        ))
        .with(Block::Preformatted(commands.join("\n")))
}

fn setting(setting: &config::Setting) -> String {
    match setting {
        config::Setting::Number { number, unit } => format!("{}{unit}", short(*number)),
        other => other.shown(),
    }
}

/// As a shell takes it.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:@%".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.to_owned();
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}

fn texts(campaign: &Campaign) -> Section {
    let plan = Section::folded("The plan").with(Block::Preformatted(campaign.source().text.clone()));
    campaign.bases().fold(plan, |section, base| {
        let title = |source: &::campaign::Source| Block::Text(source.file.clone());
        section.with(title(&base.scenario)).with(Block::Preformatted(base.scenario.text.clone()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_quoted() {
        assert_eq!(quoted("rt-config/campaigns/friction.toml"), "rt-config/campaigns/friction.toml");
        assert_eq!(quoted("my plan's.toml"), r"'my plan'\''s.toml'");
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(
            [0.0, 1.23456, 123456.7, 2e-9, -0.001_234_56].map(short),
            ["0", "1.235", "123457", "2.000e-9", "-0.001235"]
        );
        assert_eq!(short(f64::NAN), "–");
    }
}

//! Of the page: what decided how the runs came out: each metric over each varied quantity, and the share of its variance.
//!
//! Scenario by scenario: what differs between scenarios is no quantity's doing, and may hide all that is.

use super::{label, setting, shown, unit};
use ::campaign::{Campaign, Group, Level, Metric, Row, Share, Shares, course, shares};
use config::{DesignKind, Setting};
use report::{Axis, Block, Hue, Section, Style, Table, XyPlot, XySeries};

/// The metrics whose shares are told.
const TOLD: [Metric; 5] =
    [Metric::ErrorRms, Metric::ErrorPeak, Metric::FinalError, Metric::TorqueReserve, Metric::PulseRate];
/// The metric that is drawn.
const DRAWN: Metric = Metric::ErrorRms;

/// What is varied, with its value in each row.
struct Quantity {
    name: String,
    unit: String,
    is_log: bool,
    x: Vec<Level>,
}

/// The sections; none where nothing is varied or measured.
pub fn sections(campaign: &Campaign, rows: &[Row]) -> Vec<Section> {
    if campaign.plan().vary.is_empty() || !campaign.plan().task.measures() {
        return Vec::new();
    }
    let several = campaign.bases().count() > 1;
    let of = |base: &::campaign::BaseTexts| {
        let scenario = &base.scenario.file;
        let own: Vec<&Row> = rows.iter().filter(|row| campaign.scenario(row.run) == scenario).collect();
        let behind = if several { format!(": {}", label(campaign, scenario)) } else { String::new() };
        let quantities = quantities(campaign, &own);
        [effects(&own, &quantities, &behind), indices(campaign, &own, &quantities, &behind)]
    };
    campaign.bases().flat_map(of).collect()
}

fn quantities(campaign: &Campaign, rows: &[&Row]) -> Vec<Quantity> {
    let settings: Vec<Vec<Setting>> = rows.iter().map(|row| campaign.settings(row.run)).collect();
    let mut quantities: Vec<Quantity> = Vec::new();
    for (index, vary) in campaign.plan().vary.iter().enumerate() {
        let own = || settings.iter().filter_map(|of| of.get(index));
        let unit = unit_of(own());
        let x = own()
            .map(|of| match of {
                Setting::Number { number, unit: own } if *own == unit => Ok(*number),
                other => Err(setting(other)),
            })
            .collect();
        let kind = if vary.is_factor { " (factor)" } else { "" };
        quantities.push(Quantity {
            name: format!("{}{kind}", vary.path.text),
            unit,
            is_log: matches!(vary.how, config::How::Log { .. }),
            x,
        });
    }
    quantities
}

/// The unit of most values: others, as of 1 s among 500 ms, are levels by their text.
fn unit_of<'s>(values: impl Iterator<Item = &'s Setting>) -> String {
    let mut counts: std::collections::BTreeMap<&str, usize> = std::collections::BTreeMap::new();
    for value in values {
        if let Setting::Number { unit, .. } = value {
            *counts.entry(unit).or_default() += 1;
        }
    }
    let most = counts.into_iter().max_by(|a, b| a.1.cmp(&b.1).then(b.0.cmp(a.0)));
    most.map(|(unit, _)| unit.to_owned()).unwrap_or_default()
}

fn values(rows: &[&Row], metric: Metric) -> Vec<f64> {
    rows.iter().map(|row| shown(metric, metric.of(row))).collect()
}

fn effects(rows: &[&Row], quantities: &[Quantity], behind: &str) -> Section {
    let heading = format!("Main effects{behind}");
    let mut section = Section::new(heading).with(Block::Text(
        "Every point is a run; the line joins the means of runs with like values.".to_owned(),
    ));
    let y = values(rows, DRAWN);
    let (mut plots, mut tables) = (Vec::new(), Vec::new());
    for quantity in quantities {
        let groups = course(&quantity.x, &y);
        if quantity.x.iter().all(Result::is_ok) {
            plots.push(plot(&y, quantity, &groups));
        } else {
            tables.push(table(quantity, &groups));
        }
    }
    for plot in plots {
        section = section.with(Block::XyPlot(plot));
    }
    for table in tables {
        section = section.with(Block::Table(table));
    }
    section
}

fn plot(y: &[f64], quantity: &Quantity, groups: &[Group]) -> XyPlot {
    let points = quantity
        .x
        .iter()
        .zip(y)
        .filter_map(|(x, y)| Some((x.clone().ok()?, *y)).filter(|(_, y)| y.is_finite()));
    let means = groups.iter().filter_map(|group| Some((group.x.clone().ok()?, group.mean)));
    let series = |name: &str, style, hue, points| XySeries { name: name.to_owned(), style, hue, points };
    XyPlot {
        title: quantity.name.clone(),
        x: Axis { label: quantity.name.clone(), unit: quantity.unit.clone(), log: quantity.is_log },
        y: Axis::new(DRAWN.label(), unit(DRAWN)),
        series: vec![
            series("runs", Style::Points, Hue::Noise, points.collect()),
            series("mean", Style::LineAndPoints, Hue::Extended, means.collect()),
        ],
        bands: Vec::new(),
    }
}

fn table(quantity: &Quantity, groups: &[Group]) -> Table {
    let cell = |x: &Level| match x {
        Ok(number) => format!("{}{}", super::short(*number), quantity.unit),
        Err(word) => word.clone(),
    };
    let rows =
        groups.iter().map(|group| vec![cell(&group.x), group.runs.to_string(), super::short(group.mean)]);
    let mean = format!("mean of the {}, {}", DRAWN.label(), unit(DRAWN));
    Table { header: vec![quantity.name.clone(), "runs".to_owned(), mean], rows: rows.collect() }
}

fn indices(campaign: &Campaign, rows: &[&Row], quantities: &[Quantity], behind: &str) -> Section {
    let x: Vec<Vec<Level>> = quantities.iter().map(|quantity| quantity.x.clone()).collect();
    let of = |metric: Metric| {
        let y = values(rows, metric);
        // A grid is balanced only where every run has its metric.
        let is_full = campaign.plan().design.kind == DesignKind::Grid && y.iter().all(|y| y.is_finite());
        shares(&x, &y, is_full)
    };
    let found = TOLD.map(of);
    let mut header = vec!["share of the variance that it explains alone".to_owned()];
    header.extend(TOLD.map(|metric| metric.label().to_owned()));
    let row = |name: &str, cell: &dyn Fn(&Shares) -> Option<String>| {
        let told = found.iter().map(|of| of.as_ref().and_then(cell).unwrap_or_else(|| "–".to_owned()));
        [name.to_owned()].into_iter().chain(told).collect::<Vec<String>>()
    };
    let mut table_rows: Vec<Vec<String>> = quantities
        .iter()
        .enumerate()
        .map(|(index, quantity)| row(&quantity.name, &|of| of.alone.get(index).map(percent)))
        .collect();
    table_rows.push(row("not explained by any alone", &|of| Some(format!("{:.0} %", 100.0 * of.rest))));
    Section::new(format!("First-order Sobol indices{behind}"))
        .with(Block::Table(Table { header, rows: table_rows }))
        .with(Block::Text(
            "Main effects of all quantities, fitted together to these runs; ± is one standard error. The last line is what quantities do \
             together, and, where runs are few, what these can't show. A dash: fewer runs than three for each number that is fitted, or \
             the same in all."
                .to_owned(),
        ))
}

fn percent(share: &Share) -> String {
    format!("{:.0} ± {:.0} %", 100.0 * share.part, 100.0 * share.std_error)
}

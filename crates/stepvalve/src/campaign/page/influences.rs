//! Of the page: what decided how the runs came out: each metric over each varied quantity, and the share of its variance.

use super::{label, setting, shown, unit};
use ::campaign::{Campaign, Influence, Metric, Row, influence};
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
    x: Vec<Result<f64, String>>,
}

/// The sections; none where nothing is varied or measured.
pub fn sections(campaign: &Campaign, rows: &[Row]) -> Vec<Section> {
    let quantities = quantities(campaign, rows);
    if quantities.is_empty() || !campaign.plan().task.measures() {
        return Vec::new();
    }
    vec![effects(campaign, rows, &quantities), shares(campaign, rows, &quantities)]
}

fn quantities(campaign: &Campaign, rows: &[Row]) -> Vec<Quantity> {
    let settings: Vec<Vec<Setting>> = rows.iter().map(|row| campaign.settings(row.run)).collect();
    let mut quantities: Vec<Quantity> = Vec::new();
    for (index, vary) in campaign.plan().vary.iter().enumerate() {
        let own = || settings.iter().filter_map(|of| of.get(index));
        let x: Vec<Result<f64, String>> = own()
            .map(|of| match of {
                Setting::Number { number, .. } => Ok(*number),
                other => Err(setting(other)),
            })
            .collect();
        let unit = own().find_map(|of| match of {
            Setting::Number { unit, .. } => Some(unit.clone()),
            _ => None,
        });
        let kind = if vary.is_factor { " (factor)" } else { "" };
        quantities.push(Quantity {
            name: format!("{}{kind}", vary.path.text),
            unit: unit.unwrap_or_default(),
            is_log: matches!(vary.how, config::How::Log { .. }),
            x,
        });
    }
    if campaign.bases().count() > 1 {
        let x = rows.iter().map(|row| Err(label(campaign, campaign.scenario(row.run)))).collect();
        quantities.push(Quantity { name: "scenario".to_owned(), unit: String::new(), is_log: false, x });
    }
    quantities
}

fn found(campaign: &Campaign, rows: &[Row], quantity: &Quantity, metric: Metric) -> Influence {
    let y: Vec<f64> = rows.iter().map(|row| shown(metric, metric.of(row))).collect();
    // A grid is balanced only where every run has its metric.
    let is_full = campaign.plan().design.kind == DesignKind::Grid && y.iter().all(|y| y.is_finite());
    influence(&quantity.x, &y, is_full)
}

fn effects(campaign: &Campaign, rows: &[Row], quantities: &[Quantity]) -> Section {
    let mut section = Section::new("Main effects").with(Block::Text(
        "Every point is a run; the line joins the means of runs with like values.".to_owned(),
    ));
    let (mut plots, mut tables) = (Vec::new(), Vec::new());
    for quantity in quantities {
        let influence = found(campaign, rows, quantity, DRAWN);
        if quantity.x.iter().all(Result::is_ok) {
            plots.push(plot(rows, quantity, &influence));
        } else {
            tables.push(table(quantity, &influence));
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

fn plot(rows: &[Row], quantity: &Quantity, influence: &Influence) -> XyPlot {
    let points = quantity.x.iter().zip(rows).filter_map(|(x, row)| {
        Some((x.clone().ok()?, shown(DRAWN, DRAWN.of(row)))).filter(|(_, y)| y.is_finite())
    });
    let means = influence.groups.iter().filter_map(|group| Some((group.x.clone().ok()?, group.mean)));
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

fn table(quantity: &Quantity, influence: &Influence) -> Table {
    let cell = |x: &Result<f64, String>| match x {
        Ok(number) => super::short(*number),
        Err(word) => word.clone(),
    };
    let rows = influence
        .groups
        .iter()
        .map(|group| vec![cell(&group.x), group.runs.to_string(), super::short(group.mean)]);
    let mean = format!("mean of the {}, {}", DRAWN.label(), unit(DRAWN));
    Table { header: vec![quantity.name.clone(), "runs".to_owned(), mean], rows: rows.collect() }
}

fn shares(campaign: &Campaign, rows: &[Row], quantities: &[Quantity]) -> Section {
    let mut header = vec!["share of the variance that it explains alone".to_owned()];
    header.extend(TOLD.map(|metric| metric.label().to_owned()));
    let share = |quantity: &Quantity, metric: Metric| {
        let first_order = found(campaign, rows, quantity, metric).first_order;
        first_order.map_or("–".to_owned(), |share| format!("{:.0} %", 100.0 * share))
    };
    let table_rows = quantities.iter().map(|quantity| {
        let mut cells = vec![quantity.name.clone()];
        cells.extend(TOLD.map(|metric| share(quantity, metric)));
        cells
    });
    Section::new("First-order Sobol indices")
        .with(Block::Table(Table { header, rows: table_rows.collect() }))
        .with(Block::Text(
            "Estimated from groups of runs with like values, with what chance explains taken off. What is missing to 100 % are \
             effects of two and more quantities together. A dash: too few runs, or the same in all."
                .to_owned(),
        ))
}

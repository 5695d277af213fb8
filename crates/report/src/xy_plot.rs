//! One quantity over another, on linear or logarithmic axes.

use crate::view::view;
use crate::{Hue, encode};
use serde_json::{Value, json};

/// An axis of an [`XyPlot`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// What it measures.
    pub label: String,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// Logarithmic: only values above zero can be shown.
    pub log: bool,
}

impl Axis {
    /// A linear axis.
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), log: false }
    }

    /// A logarithmic axis.
    pub fn log(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), log: true }
    }

    fn plotted(&self, value: f64) -> f64 {
        if self.log { value.log10() } else { value }
    }

    pub(crate) fn to_json(&self) -> Value {
        json!({ "label": self.label, "unit": self.unit, "log": self.log })
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// A line in the order of the points.
    Line,
    /// Points alone.
    Points,
    /// Points joined by a line.
    LineAndPoints,
}

/// One series of an [`XyPlot`].
#[derive(Debug, Clone, PartialEq)]
pub struct XySeries {
    /// Its name, as in the legend.
    pub name: String,
    /// How it is drawn.
    pub style: Style,
    /// Its colour.
    pub hue: Hue,
    /// x and y; where one is not finite, the line has a gap.
    pub points: Vec<(f64, f64)>,
}

/// A part of the x axis that stands out.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Where it begins.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
    /// What it is.
    pub label: String,
}

/// A plot of y over x.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct XyPlot {
    /// What it shows.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Its series.
    pub series: Vec<XySeries>,
    /// Parts of the x axis that stand out, behind the series.
    pub bands: Vec<Band>,
}

/// A series made ready for the page.
struct Thinned {
    json: Value,
    /// Points that a logarithmic axis can't show.
    hidden: usize,
    cells: Option<f64>,
}

impl XyPlot {
    /// For the page's script, and the notes that belong below the plot.
    pub(crate) fn to_json(&self) -> (Value, Vec<String>) {
        let thinned: Vec<Thinned> = self.series.iter().map(|series| self.series_to_json(series)).collect();
        let mut notes = Vec::new();
        let hidden: usize = thinned.iter().map(|series| series.hidden).sum();
        if hidden > 0 {
            let (are, them) = if hidden == 1 { ("point is", "it") } else { ("points are", "them") };
            let hidden = crate::html::grouped(hidden);
            notes.push(format!("{hidden} {are} not above zero: a logarithmic axis can't show {them}."));
        }
        if let Some(cells) = thinned.iter().filter_map(|series| series.cells).reduce(f64::min) {
            let points = crate::html::grouped(self.points());
            notes.push(format!(
                "{points} points; those closer than 1/{cells} of the plot's sides are drawn as one."
            ));
        }
        let series: Vec<Value> = thinned.into_iter().map(|series| series.json).collect();
        let band = |band: &Band| json!({ "from": band.from, "to": band.to, "label": band.label });
        let mut json = json!({
            "kind": "xy", "title": self.title, "x": self.x.to_json(), "y": self.y.to_json(), "series": series,
            "bands": self.bands.iter().map(band).collect::<Vec<_>>(),
        });
        let values = || self.series.iter().flat_map(|series| series.points.iter().map(|point| point.1));
        if let Some(view) = (!self.y.log).then(|| view(values())).flatten() {
            notes.push(view.note(&self.y.unit));
            if let Some(fields) = json.as_object_mut() {
                fields.insert("view".to_owned(), json!([view.low, view.high]));
            }
        }
        (json, notes)
    }

    fn points(&self) -> usize {
        self.series.iter().map(|series| series.points.len()).sum()
    }

    fn series_to_json(&self, series: &XySeries) -> Thinned {
        let plotted = |&(x, y): &(f64, f64)| (self.x.plotted(x), self.y.plotted(y));
        let finite = |(x, y): (f64, f64)| (x.is_finite() && y.is_finite()).then_some((x, y));
        let points: Vec<_> = series.points.iter().map(|point| finite(plotted(point))).collect();
        let hidden = points
            .iter()
            .zip(&series.points)
            .filter(|(plotted, point)| plotted.is_none() && point.0.is_finite() && point.1.is_finite());
        let hidden = hidden.count();
        let (kept, cells) = crate::thinning::thin(&points, series.style != Style::Points);
        let (mut x, mut y) = (Vec::with_capacity(kept.len()), Vec::with_capacity(kept.len()));
        for index in kept {
            let shown = index.filter(|&index| points.get(index).is_some_and(Option::is_some));
            let &(px, py) = shown.and_then(|index| series.points.get(index)).unwrap_or(&(f64::NAN, f64::NAN));
            x.push(px);
            y.push(py);
        }
        Thinned { json: arrays(&series.name, style(series.style), series.hue, x, y), hidden, cells }
    }
}

fn style(style: Style) -> &'static str {
    match style {
        Style::Line => "line",
        Style::Points => "points",
        Style::LineAndPoints => "both",
    }
}

/// A series of x and y for the page's script; `style` is one of its words.
pub(crate) fn arrays(name: &str, style: &str, hue: Hue, x: Vec<f64>, y: Vec<f64>) -> Value {
    json!({ "name": name, "style": style, "hue": hue.name(), "x": encode::float64(x), "y": encode::float64(y) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_log_axis_cannot_show_is_counted() {
        let points = vec![(1.0, 1.0), (0.0, 1.0), (-1.0, 2.0), (f64::NAN, 1.0)];
        let series = vec![XySeries { name: "s".into(), style: Style::Points, hue: Hue::ByPlace, points }];
        let plot = XyPlot {
            title: "t".into(),
            x: Axis::log("speed", "rad/s"),
            y: Axis::new("torque", "N·m"),
            series,
            bands: Vec::new(),
        };
        let (_, notes) = plot.to_json();
        assert_eq!(notes, ["2 points are not above zero: a logarithmic axis can't show them."]);
    }
}

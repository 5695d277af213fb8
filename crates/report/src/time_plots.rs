//! Signals over time: panels one above the other on one common axis.

use crate::{Marker, Strip, TimeAxis, Trace};
use serde_json::{Value, json};

/// How a signal is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Line {
    /// A line.
    #[default]
    Normal,
    /// A broad pale line for what the others are held against, such as the reference beneath the angle.
    Underlay,
    /// A dashed line.
    Dashed,
}

/// One signal of a panel.
#[derive(Debug, Clone)]
pub struct Series {
    /// Its name, as in the legend.
    pub name: String,
    /// Unit of its values, as on the axis.
    pub unit: String,
    /// Its values.
    pub trace: Trace,
    /// How it is drawn.
    pub line: Line,
}

/// A plot of some signals over time. The first unit stands on the left axis, a second on the right; signals of
/// further units, or on another [`TimeAxis`], get a panel of their own below.
#[derive(Debug, Clone)]
pub struct Panel {
    /// What it shows.
    pub title: String,
    /// Its signals.
    pub series: Vec<Series>,
}

impl Panel {
    /// An empty panel.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), series: Vec::new() }
    }

    /// The panel with one more signal.
    #[must_use]
    pub fn with(self, name: impl Into<String>, unit: impl Into<String>, trace: Trace) -> Self {
        self.with_line(name, unit, trace, Line::Normal)
    }

    /// The panel with one more signal, drawn as `line` says.
    #[must_use]
    pub fn with_line(
        mut self,
        name: impl Into<String>,
        unit: impl Into<String>,
        trace: Trace,
        line: Line,
    ) -> Self {
        self.series.push(Series { name: name.into(), unit: unit.into(), trace, line });
        self
    }
}

/// Panels with a common time axis: zoom and cursor are one for all.
#[derive(Debug, Clone, Default)]
pub struct TimePlots {
    /// States and the like, shown above the panels.
    pub strips: Vec<Strip>,
    /// Moments marked through all panels.
    pub markers: Vec<Marker>,
    /// The panels, from top to bottom; those without signals are left out.
    pub panels: Vec<Panel>,
}

/// The signals that can be drawn in one plot: one time axis, at most two units.
struct Part<'a> {
    title: &'a str,
    axis: usize,
    units: Vec<&'a str>,
    series: Vec<&'a Series>,
}

impl TimePlots {
    /// For the page's script.
    pub(crate) fn to_json(&self) -> Value {
        let axes = self.axes();
        let parts = self.panels.iter().flat_map(|panel| parts(panel, &axes));
        json!({
            "kind": "time",
            "axes": axes.iter().map(|axis| axis.to_json()).collect::<Vec<_>>(),
            "panels": parts.map(|part| part.to_json()).collect::<Vec<_>>(),
            "strips": self.strips.iter().map(Strip::to_json).collect::<Vec<_>>(),
            "markers": self.markers.iter().map(Marker::to_json).collect::<Vec<_>>(),
        })
    }

    /// What the page holds of each axis, a sentence each.
    pub(crate) fn describe(&self) -> Vec<String> {
        self.axes().iter().map(|axis| axis.describe()).collect()
    }

    /// Whether there is anything to draw.
    pub(crate) fn is_empty(&self) -> bool {
        self.axes().iter().all(|axis| axis.samples() == 0)
            && self.markers.is_empty()
            && self.strips.iter().all(|strip| strip.intervals.is_empty())
    }

    fn axes(&self) -> Vec<&TimeAxis> {
        let mut axes: Vec<&TimeAxis> = Vec::new();
        for series in self.panels.iter().flat_map(|panel| &panel.series) {
            if !axes.iter().any(|axis| axis.is(&series.trace.axis)) {
                axes.push(&series.trace.axis);
            }
        }
        axes
    }
}

fn parts<'a>(panel: &'a Panel, axes: &[&TimeAxis]) -> Vec<Part<'a>> {
    let mut parts: Vec<Part> = Vec::new();
    for series in &panel.series {
        let Some(axis) = axes.iter().position(|axis| axis.is(&series.trace.axis)) else { continue };
        let unit = series.unit.as_str();
        let fits =
            |part: &&mut Part| part.axis == axis && (part.units.contains(&unit) || part.units.len() < 2);
        match parts.iter_mut().find(fits) {
            Some(part) => part.add(series),
            None => {
                let mut part = Part { title: &panel.title, axis, units: Vec::new(), series: Vec::new() };
                part.add(series);
                parts.push(part);
            }
        }
    }
    parts
}

impl<'a> Part<'a> {
    fn add(&mut self, series: &'a Series) {
        if !self.units.contains(&series.unit.as_str()) {
            self.units.push(&series.unit);
        }
        self.series.push(series);
    }

    fn to_json(&self) -> Value {
        let series: Vec<Value> = self.series.iter().map(|series| self.series_to_json(series)).collect();
        json!({ "title": self.title, "axis": self.axis, "units": self.units, "series": series })
    }

    fn series_to_json(&self, series: &Series) -> Value {
        let line = match series.line {
            Line::Normal => "normal",
            Line::Underlay => "underlay",
            Line::Dashed => "dashed",
        };
        json!({
            "name": series.name,
            "scale": self.units.iter().position(|unit| *unit == series.unit),
            "line": line,
            "offset": series.trace.offset,
            "values": crate::encode::float32(series.trace.values.iter().copied()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_unit_and_another_axis_get_panels_of_their_own() {
        let axis = TimeAxis::new(&[0.0, 1.0], 1, &[]).unwrap();
        let other = TimeAxis::new(&[0.0, 2.0], 1, &[]).unwrap();
        let on = |axis: &TimeAxis| axis.trace([1.0, 2.0]).unwrap();
        let panel = Panel::new("oil")
            .with("pressure", "bar", on(&axis))
            .with("flow", "L/min", on(&axis))
            .with("temperature", "°C", on(&axis))
            .with("tank", "bar", on(&axis))
            .with("late", "bar", on(&other));
        let plots = TimePlots { panels: vec![panel], ..TimePlots::default() };
        let json = plots.to_json();
        let names = |part: usize| -> Vec<&str> {
            let series = json["panels"][part]["series"].as_array().unwrap();
            series.iter().map(|series| series["name"].as_str().unwrap()).collect()
        };
        assert_eq!(names(0), ["pressure", "flow", "tank"]);
        assert_eq!(names(1), ["temperature"]);
        assert_eq!(names(2), ["late"]);
        assert_eq!(json["panels"][2]["axis"], 1);
        assert_eq!(json["panels"][0]["series"][1]["scale"], 1);
    }
}

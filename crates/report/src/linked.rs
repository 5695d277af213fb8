//! The same samples over several quantities: what is selected in one plot lights up in all of them, and in the tables of runs.

use crate::view::view;
use crate::{Axis, Hue, encode};
use serde_json::{Value, json};

/// A quantity that samples are plotted over.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariate {
    /// What it is, and its unit.
    pub axis: Axis,
    /// Its value at each sample; NaN where there is none.
    pub values: Vec<f64>,
    /// Whether its plot is shown at first.
    pub shown: bool,
}

/// What is plotted over each of them.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkedSeries {
    /// Its name, as in the legend.
    pub name: String,
    /// Its colour.
    pub hue: Hue,
    /// Its value at each sample.
    pub values: Vec<f64>,
}

/// Plots of the same samples over several quantities.
#[derive(Debug, Clone, PartialEq)]
pub struct Linked {
    /// The common vertical axis.
    pub y: Axis,
    /// The quantities; the reader picks which are shown.
    pub covariates: Vec<Covariate>,
    /// What is plotted.
    pub series: Vec<LinkedSeries>,
    /// The names of what samples belong to, such as runs; those of rows that open in an [`crate::OpeningTable`].
    pub groups: Vec<String>,
    /// Which one each sample belongs to.
    pub group: Vec<u32>,
}

impl Linked {
    /// For the page's script, and the notes that belong below the plots.
    pub(crate) fn to_json(&self) -> (Value, Vec<String>) {
        let floats = |values: &[f64]| encode::float32(values.iter().map(|value| *value as f32));
        let covariates = self
            .covariates
            .iter()
            .map(|of| json!({ "axis": of.axis.to_json(), "shown": of.shown, "values": floats(&of.values) }));
        let series = self
            .series
            .iter()
            .map(|of| json!({ "name": of.name, "hue": of.hue.name(), "values": floats(&of.values) }));
        let view = view(self.series.iter().flat_map(|series| series.values.iter().copied()));
        let notes = view.iter().map(|view| view.note(&self.y.unit)).collect();
        let json = json!({
            "kind": "linked", "y": self.y.to_json(),
            "covariates": covariates.collect::<Vec<_>>(), "series": series.collect::<Vec<_>>(),
            "groups": self.groups, "group": encode::float32(self.group.iter().map(|of| *of as f32)),
            "view": view.map(|view| [view.low, view.high]),
        });
        (json, notes)
    }
}

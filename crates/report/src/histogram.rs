//! Distributions as steps over their bins, counts on a logarithmic axis: the rare and late show as well as the rest.

use crate::{Axis, Hue, Table, html, xy_plot};
use serde_json::{Value, json};

/// The parts of a distribution that its table names.
const QUANTILES: [f64; 4] = [0.5, 0.99, 0.999, 0.999_99];

/// A distribution by its bins.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Distribution {
    /// Its name, as in the legend.
    pub name: String,
    /// Where the first bin begins.
    pub lower_edge: f64,
    /// Upper edge and count of each bin, upwards, each bin beginning where the one before ends.
    pub bins: Vec<(f64, u64)>,
}

/// A plot of distributions of one quantity, with a table of their quantiles.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// What it shows.
    pub title: String,
    /// The quantity.
    pub x: Axis,
    /// Its distributions.
    pub distributions: Vec<Distribution>,
}

impl Distribution {
    /// Number of samples.
    pub fn count(&self) -> u64 {
        self.bins.iter().map(|bin| bin.1).sum()
    }

    /// The upper edge of the bin that holds the given part (0 to 1) of the samples; None without samples.
    pub fn quantile(&self, part: f64) -> Option<f64> {
        let wanted = ((part * self.count() as f64).ceil() as u64).max(1);
        let mut below = 0;
        self.bins.iter().find_map(|&(edge, count)| {
            below += count;
            (below >= wanted).then_some(edge)
        })
    }

    /// Edges and counts without the empty bins at both ends: one more edge than counts.
    fn steps(&self, log: bool) -> (Vec<f64>, Vec<f64>) {
        let first = self.bins.iter().position(|bin| bin.1 > 0).unwrap_or(0);
        let last = self.bins.iter().rposition(|bin| bin.1 > 0).map_or(0, |last| last + 1);
        let used = self.bins.get(first..last).unwrap_or_default();
        let begin =
            first.checked_sub(1).and_then(|before| self.bins.get(before)).map_or(self.lower_edge, |b| b.0);
        let mut edges = vec![begin];
        edges.extend(used.iter().map(|bin| bin.0));
        if let (true, Some(&second)) = (log, edges.get(1)) {
            // A logarithmic axis has no zero: half of the first upper edge stands for it.
            edges.iter_mut().take(1).filter(|edge| **edge <= 0.0).for_each(|edge| *edge = second / 2.0);
        }
        (edges, used.iter().map(|bin| bin.1 as f64).collect())
    }
}

impl Histogram {
    /// For the page's script.
    pub(crate) fn to_json(&self) -> Value {
        let series = self.distributions.iter().map(|distribution| {
            let (edges, counts) = distribution.steps(self.x.log);
            xy_plot::arrays(&distribution.name, "steps", Hue::ByPlace, edges, counts)
        });
        json!({
            "kind": "xy", "title": self.title, "x": self.x.to_json(),
            "y": Axis::log("count", "").to_json(), "series": series.collect::<Vec<_>>(),
        })
    }

    /// Count and quantiles of each distribution.
    pub(crate) fn quantiles(&self) -> Table {
        let heading = if self.x.unit.is_empty() { String::new() } else { format!("in {}", self.x.unit) };
        let mut header = vec![heading, "count".to_owned()];
        header.extend(["median", "99 %", "99.9 %", "99.999 %", "largest"].map(str::to_owned));
        let rows = self.distributions.iter().map(|distribution| {
            let mut row = vec![distribution.name.clone(), html::grouped(distribution.count() as usize)];
            let edges = QUANTILES.into_iter().chain([1.0]).map(|part| distribution.quantile(part));
            row.extend(
                edges.map(|edge| edge.map_or("–".to_owned(), |edge| format!("≤ {}", html::number(edge)))),
            );
            row
        });
        Table { header, rows: rows.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distribution() -> Distribution {
        let bins = vec![(1.0, 0), (2.0, 90), (3.0, 0), (4.0, 9), (5.0, 1), (6.0, 0)];
        Distribution { name: "plant".into(), lower_edge: 0.0, bins }
    }

    #[test]
    fn quantiles_are_upper_edges() {
        let found =
            [0.0, 0.5, 0.9, 0.91, 0.99, 0.991, 1.0].map(|part| distribution().quantile(part).unwrap());
        assert_eq!(found, [2.0, 2.0, 2.0, 4.0, 4.0, 5.0, 5.0]);
        assert_eq!(Distribution::default().quantile(0.5), None);
    }

    #[test]
    fn empty_ends_are_left_out_and_zero_has_no_logarithm() {
        assert_eq!(distribution().steps(false), (vec![1.0, 2.0, 3.0, 4.0, 5.0], vec![90.0, 0.0, 9.0, 1.0]));
        let one = Distribution { bins: vec![(8.0, 3)], ..Distribution::default() };
        assert_eq!(one.steps(true), (vec![4.0, 8.0], vec![3.0]));
        assert_eq!(Distribution::default().steps(true), (vec![0.0], vec![]));
    }
}

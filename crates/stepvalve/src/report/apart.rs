//! How far two logs of the same samples are apart, such as measured runs and what a model predicts of them.

use super::figures::Spread;
use super::panels::shown_as;
use super::table::Table;
use super::text;
use ::report::{Line, Panel, TimeAxis};
use anyhow::Result;
use run_log::RunLogError;

/// What is compared sample by sample, with its name.
const COLUMNS: [(&str, &str); 3] = [("Torque", "torque"), ("Angle", "angle"), ("Flow", "flow")];

/// B less A of one column.
pub struct Apart {
    what: &'static str,
    unit: &'static str,
    /// In `unit`, NaN where one of the two has no value.
    by: Vec<f64>,
    off: Spread,
    /// RMS of A about its mean.
    of_a: f64,
}

/// The columns in which two logs differ; none where their samples are not at the same times.
///
/// # Errors
/// [`RunLogError`].
pub fn apart(a: &Table, b: &Table, common_times: usize) -> Result<Vec<Apart>, RunLogError> {
    if [a.time_s.len(), b.time_s.len()] != [common_times; 2] {
        return Ok(Vec::new());
    }
    let mut found = Vec::new();
    for (what, column) in COLUMNS {
        let (unit, factor) = shown_as(column);
        let read =
            |of: &Table| of.file.column(column, |values| values.map(|v| v * factor).collect::<Vec<_>>());
        if let (Some(of_a), Some(of_b)) = (read(a)?, read(b)?) {
            found.extend(Apart::new(what, unit, &of_a, &of_b));
        }
    }
    Ok(found)
}

impl Apart {
    /// `None` where the two are alike, or never there together.
    fn new(what: &'static str, unit: &'static str, a: &[f64], b: &[f64]) -> Option<Self> {
        let by: Vec<f64> = a.iter().zip(b).map(|(a, b)| b - a).collect();
        let off = Spread::of(by.iter().copied().enumerate())?;
        let both: Vec<f64> = a.iter().zip(&by).filter(|(_, by)| !by.is_nan()).map(|(a, _)| *a).collect();
        let mean = both.iter().sum::<f64>() / both.len() as f64;
        let of_a = Spread::of(both.iter().map(|a| a - mean).enumerate())?;
        (off.peak > 0.0).then_some(Self { what, unit, off, of_a: of_a.rms, by })
    }

    /// In one sentence.
    pub fn headline(&self) -> String {
        let Self { what, unit, .. } = self;
        let [rms, peak, of_a] = [self.off.rms, self.off.peak, self.of_a].map(text::number);
        format!(
            "{what}: B is off A by {rms} {unit} RMS and {peak} {unit} at the peak; A itself varies by {of_a} {unit} RMS."
        )
    }

    /// Its line among the key figures: what, of A, of B.
    pub fn row(&self, times_s: &[f64]) -> Vec<String> {
        let Self { what, unit, off: Spread { rms, peak_row, .. }, of_a, .. } = self;
        let peak = self.by.get(*peak_row).copied().unwrap_or(f64::NAN);
        let at = times_s.get(*peak_row).map_or(String::new(), |at| format!(" at {}", text::moment(*at)));
        let [rms, of_a, peak] = [*rms, *of_a, peak].map(text::number);
        let off = format!("off A by {rms} {unit} RMS, {peak} {unit} at the peak{at}");
        vec![what.to_string(), format!("varies by {of_a} {unit} RMS"), off]
    }

    /// Its plot.
    ///
    /// # Errors
    /// Where it does not fit the axis.
    pub fn panel(&self, axis: &TimeAxis) -> Result<Panel> {
        let trace = axis.trace(self.by.iter().copied())?;
        Ok(Panel::new(format!("{}, B less A", self.what)).with_line(
            "B less A",
            self.unit,
            trace,
            Line::Normal,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_over_what_both_have() {
        let (a, b) = ([1.0, -1.0, f64::NAN, 1.0, -1.0], [1.5, -1.5, 7.0, f64::NAN, -1.0]);
        let found = Apart::new("Torque", "N·m", &a, &b).unwrap();
        // Differences 0.5, -0.5, 0; of A 1, -1, -1.
        assert!((found.off.rms - (0.5_f64 / 3.0).sqrt()).abs() < 1e-12, "{:?}", found.off);
        assert!((found.of_a - (8.0_f64 / 9.0).sqrt()).abs() < 1e-12, "{}", found.of_a);
        assert_eq!(found.off.peak, 0.5);
        assert!(Apart::new("Torque", "N·m", &a, &a).is_none());
        assert!(Apart::new("Torque", "N·m", &[f64::NAN], &[1.0]).is_none());
    }
}

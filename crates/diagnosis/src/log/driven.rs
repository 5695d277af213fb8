//! The inputs of a piece, sample by sample: time, command, pressure and temperature, with a lead before the piece.

use log_data::Run;
use std::ops::Range;

/// Lead before a piece of an angle log, s: its prediction starts from estimated speed and bristles, and the transient
/// decays within it.
const LEAD_S: f64 = 0.3;

/// The channels, the lead's samples first. A channel that the run doesn't have is empty.
#[derive(Debug, Clone)]
pub(crate) struct Driven {
    lead: usize,
    time_s: Vec<f64>,
    command_rad: Vec<f64>,
    pressure_pa: Vec<f64>,
    temperature_c: Vec<f64>,
    reference_temperature_c: f64,
}

/// The row at which the lead before `row` begins.
pub(crate) fn lead_of(run: &Run, row: usize) -> usize {
    let begins_s = run.time_s.get(row).copied().unwrap_or(f64::NAN) - LEAD_S;
    run.time_s.partition_point(|time_s| *time_s < begins_s).min(row)
}

impl Driven {
    /// The run's channels from `lead_row` to the end of `rows`; nominal temperature where none was measured.
    pub fn new(run: &Run, lead_row: usize, rows: &Range<usize>, reference_temperature_c: f64) -> Self {
        let cut = |values: Option<&[f64]>| {
            values.and_then(|all| all.get(lead_row..rows.end)).unwrap_or_default().to_vec()
        };
        Self {
            lead: rows.start - lead_row,
            time_s: cut(Some(&run.time_s)),
            command_rad: cut(run.angle_command_rad.as_deref()),
            pressure_pa: cut(run.pressure_drop_pa.as_deref()),
            temperature_c: cut(run.oil_temperature_c.as_deref()),
            reference_temperature_c,
        }
    }

    /// Samples before the piece.
    pub fn lead(&self) -> usize {
        self.lead
    }

    /// All times, the lead's too, s.
    pub fn all_times_s(&self) -> &[f64] {
        &self.time_s
    }

    /// The piece's times, s.
    pub fn time_s(&self) -> &[f64] {
        self.own(&self.time_s)
    }

    /// The piece's commands, rad.
    pub fn command_rad(&self) -> &[f64] {
        self.own(&self.command_rad)
    }

    /// The piece's pressure drops, Pa.
    pub fn pressure_pa(&self) -> &[f64] {
        self.own(&self.pressure_pa)
    }

    /// The piece's oil temperatures, °C.
    pub fn temperature_c(&self) -> &[f64] {
        self.own(&self.temperature_c)
    }

    /// The command at a sample counted from the lead's first, rad.
    pub fn command_at(&self, index: usize) -> f64 {
        self.command_rad.get(index).copied().unwrap_or(f64::NAN)
    }

    /// Pressure drop, Pa, and oil temperature, °C: the mean of the sample before and this one. `index` counts from the lead's
    /// first sample.
    pub fn conditions(&self, index: usize) -> (f64, f64) {
        let middle = |values: &[f64], default: f64| {
            let here = values.get(index).copied().unwrap_or(default);
            0.5 * (values.get(index.saturating_sub(1)).copied().unwrap_or(here) + here)
        };
        (middle(&self.pressure_pa, 0.0), middle(&self.temperature_c, self.reference_temperature_c))
    }

    fn own<'a>(&self, values: &'a [f64]) -> &'a [f64] {
        values.get(self.lead..).unwrap_or_default()
    }
}

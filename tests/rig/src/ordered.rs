//! Runs that somebody else has planned: `[[run]]` entries of a next-experiment.toml, made on the machine of a campaign.

use crate::motion::{Motion, Tone};
use crate::plan::RunPlan;
use anyhow::{Context, Result, anyhow};
use serde::Deserialize;

/// How fast a constant speed is reached, s.
const RAMP_S: f64 = 0.05;
/// Before and behind each motion, s.
const LEAD_S: f64 = 0.1;
/// From one run to the next, s.
const BETWEEN_S: f64 = 2.0;

/// A run as ordered.
#[derive(Debug, Clone, Deserialize)]
pub struct OrderedRun {
    name: String,
    motion: String,
    middle_rad: f64,
    #[serde(default)]
    amplitude_rad: f64,
    #[serde(default)]
    frequency_hz: f64,
    #[serde(default)]
    speed_rad_per_s: f64,
    #[serde(default)]
    way_rad: f64,
    #[serde(default)]
    rest_s: f64,
    for_s: f64,
    pressure_drop_pa: Option<f64>,
    oil_temperature_c: Option<f64>,
}

#[derive(Deserialize)]
struct Orders {
    run: Vec<OrderedRun>,
}

/// Reads the runs of a plan.
///
/// # Errors
/// A text that is no plan.
pub fn ordered(text: &str) -> Result<Vec<OrderedRun>> {
    let orders: Orders = toml::from_str(text).context("expected [[run]] entries")?;
    Ok(orders.run)
}

impl OrderedRun {
    /// Its motion, and the kind that it has in the log.
    fn motion(&self) -> Result<(&'static str, Motion)> {
        let Self { speed_rad_per_s: speed, way_rad, rest_s, for_s, .. } = *self;
        let there_and_back = |before_s: f64| {
            let one_s = before_s + way_rad / speed + RAMP_S;
            let legs: Vec<(f64, f64)> = (0..(for_s / one_s).ceil() as usize)
                .flat_map(|leg| {
                    let direction = if leg % 2 == 0 { 1.0 } else { -1.0 };
                    [(0.0, before_s), (direction * speed, way_rad / speed)]
                })
                .filter(|(speed, _)| *speed != 0.0 || before_s > 0.0)
                .collect();
            let mut motion = Motion::legs(&legs, RAMP_S, LEAD_S);
            motion.start_rad = self.middle_rad - 0.5 * way_rad;
            motion
        };
        Ok(match self.motion.as_str() {
            "sine" => {
                let tone = Tone {
                    amplitude_rad: self.amplitude_rad,
                    frequency_hz: self.frequency_hz,
                    phase_rad: 0.0,
                };
                let mut motion = Motion::tones(vec![tone], LEAD_S, for_s, 1.0 / self.frequency_hz);
                motion.start_rad = self.middle_rad;
                ("sine", motion)
            }
            "both-ways" => ("constant-velocity", there_and_back(0.0)),
            "start-stop" => ("start-stop", there_and_back(rest_s)),
            "one-way" => {
                let mut motion = Motion::legs(&[(speed, for_s)], RAMP_S, LEAD_S);
                motion.start_rad = self.middle_rad;
                ("constant-velocity", motion)
            }
            other => return Err(anyhow!("{}: no motion is called {other:?}", self.name)),
        })
    }

    /// The run behind those that were made.
    fn plan(&self, made: &[RunPlan]) -> Result<RunPlan> {
        let last = made.last().context("a campaign without runs")?;
        let step_s = last.times_s.windows(2).map(|pair| pair[1] - pair[0]).next().unwrap_or(1e-3);
        let (kind, motion) = self.motion()?;
        let mut plan = RunPlan::new(kind, motion, step_s, 0.0, LEAD_S);
        plan.name.clone_from(&self.name);
        plan.rest_s = BETWEEN_S;
        plan.clock_s = last.clock_s + last.end_s() + BETWEEN_S;
        plan.pressure_mpa.mean = self.pressure_drop_pa.map_or(last.pressure_mpa.mean, |value| 1e-6 * value);
        plan.celsius.mean = self.oil_temperature_c.unwrap_or(last.celsius.mean);
        Ok(plan)
    }
}

/// The runs behind those that were made.
pub(crate) fn plans(orders: &[OrderedRun], made: &[RunPlan]) -> Result<Vec<RunPlan>> {
    let mut all = made.to_vec();
    for order in orders {
        let plan = order.plan(&all)?;
        all.push(plan);
    }
    Ok(all.split_off(made.len()))
}

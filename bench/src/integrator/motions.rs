//! The motions that are compared: the commands of the shipped closed-loop scenarios, and a break-away ramp.

use crate::scenario::repository;
use anyhow::{Context, Result, anyhow};
use closed_loop::{InProcess, wire};
use config::{parse_model, parse_scenario};

/// Length of a cycle, s.
pub const PERIOD_S: f64 = 1e-3;

/// A command, linear between the cycles.
pub struct Motion {
    /// Its name.
    pub name: String,
    /// θ_cmd at the cycles, rad.
    pub commands: Vec<f64>,
    /// Whether all laws go through it, not LuGre alone.
    pub for_all_laws: bool,
}

/// The scenarios at 1 kHz whose motor turns, and whether all laws are tried with them.
const SCENARIOS: [(&str, bool); 5] = [
    ("sine-1hz", true),
    ("step-sequence", false),
    ("flow-steps", false),
    ("rotation-200khz", false),
    ("rotation-600khz", false),
];

/// Every motion of the table.
///
/// # Errors
/// Where a shipped scenario is refused.
pub fn all(quick: bool) -> Result<Vec<Motion>> {
    let cycles = if quick { 600 } else { 4000 };
    let scenarios = SCENARIOS.iter().map(|(name, for_all_laws)| {
        Ok(Motion {
            name: (*name).to_owned(),
            commands: commands(name, cycles)?,
            for_all_laws: *for_all_laws,
        })
    });
    scenarios.chain([Ok(break_away())]).collect()
}

/// 0.2 rad/s from rest, to just before the first slip ends: the load on the contact rises by 60 N·m/s.
fn break_away() -> Motion {
    let commands = (0..=120).map(|k| 0.2 * f64::from(k) * PERIOD_S).collect();
    Motion { name: "break-away ramp".to_owned(), commands, for_all_laws: true }
}

/// The commands that the plant was given in a shipped scenario, from the first cycle on.
fn commands(name: &str, cycles: usize) -> Result<Vec<f64>> {
    let folder = repository().join("rt-config/scenarios");
    let path = folder.join(format!("{name}.toml"));
    let read =
        |path: &std::path::Path| std::fs::read_to_string(path).with_context(|| path.display().to_string());
    let scenario = parse_scenario(&read(&path)?, name).map_err(|errors| anyhow!("{errors}"))?;
    let model =
        |file: &str| parse_model(&read(&folder.join(file))?, file).map_err(|errors| anyhow!("{errors}"));
    let parts = wire(&scenario, &model(&scenario.truth)?, &model(&scenario.belief)?)?;
    Ok(InProcess::new(&parts).take(cycles).map(|cycle| cycle.plant.truth.command_angle_rad).collect())
}

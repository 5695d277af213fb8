//! An experiment for a rig whose motion is measured beside a torque: runs as TOML for people and programs, and as CSV for drives.

use super::motion::{Motion, motions};
use super::within::{Conditions, Machine};
use diagnosis::Trial;
use log_data::Run;
use std::fmt::Write;

/// A run is worked out from so many samples at most; it counts for as many as the machine takes.
const SAMPLES: f64 = 1500.0;
/// From one run to the next, s: to bring the machine there.
const BETWEEN_S: f64 = 2.0;
/// The plan's own samples are no closer than this, s: drives interpolate.
const CLOSEST_S: f64 = 1e-3;

/// A run that could be made.
pub struct Part {
    pub motion: Motion,
    pub conditions: Conditions,
}

/// Every run that could be made, and what it would be.
pub fn parts(machine: &Machine) -> Vec<Part> {
    let of = |conditions: &Conditions| {
        let conditions = *conditions;
        motions(&machine.bounds).into_iter().map(move |motion| Part { motion, conditions })
    };
    machine.conditions.iter().flat_map(of).collect()
}

impl Part {
    /// The run as it would be measured, with a torque in the place of that.
    pub fn trial(&self, machine: &Machine) -> Trial {
        let takes_s = self.motion.takes_s();
        let step_s = machine.step_s.max(takes_s / SAMPLES);
        let rows = (takes_s / step_s) as usize;
        let begin_s = machine.ended_s + BETWEEN_S;
        let times = (0..rows).map(|row| row as f64 * step_s);
        let all = |value: Option<f64>| value.map(|value| vec![value; rows]);
        let run = Run {
            name: self.motion.kind().to_owned(),
            kind: self.motion.kind().to_owned(),
            angle_rad: times.clone().map(|time_s| machine.middle_rad + self.motion.at(time_s)).collect(),
            time_s: times.map(|time_s| begin_s + time_s).collect(),
            torque_nm: Some(vec![0.0; rows]),
            pressure_drop_pa: all(self.conditions.pressure_pa),
            oil_temperature_c: all(self.conditions.temperature_c),
            ..Run::default()
        };
        Trial { run, takes_s: takes_s + BETWEEN_S, samples: takes_s / machine.step_s }
    }
}

/// `[[run]]` for each part.
pub fn toml(parts: &[&Part], machine: &Machine) -> String {
    let mut text = String::new();
    for (place, part) in parts.iter().enumerate() {
        // Writing into a string can't fail.
        let _ = writeln!(text, "\n[[run]]\nname = \"{}\"\nmotion = \"{}\"", name(place), part.motion.kind());
        let _ = writeln!(text, "middle_rad = {:?}", rounded(machine.middle_rad));
        for (key, value) in part.motion.numbers().into_iter().chain(conditions(part)) {
            let _ = writeln!(text, "{key} = {:?}", rounded(value));
        }
    }
    text
}

/// Every run's samples: a line for each, the drive goes linearly between them.
pub fn csv(parts: &[&Part], machine: &Machine) -> String {
    let named: Vec<&str> =
        parts.first().map_or(Vec::new(), |part| conditions(part).into_iter().map(|(key, _)| key).collect());
    let mut text = ["run", "time_s", "angle_rad", "speed_rad_per_s"]
        .into_iter()
        .chain(named)
        .collect::<Vec<_>>()
        .join(",");
    text.push('\n');
    let step_s = machine.step_s.max(CLOSEST_S);
    for (place, part) in parts.iter().enumerate() {
        let conditions: String =
            conditions(part).into_iter().map(|(_, value)| format!(",{:?}", rounded(value))).collect();
        let rows = (part.motion.takes_s() / step_s) as usize;
        for row in 0..rows {
            let time_s = row as f64 * step_s;
            let angle = |time_s: f64| machine.middle_rad + part.motion.at(time_s);
            let speed = (angle(time_s + step_s) - angle(time_s)) / step_s;
            let _ = writeln!(text, "{},{time_s:.4},{:.7},{speed:.6}{conditions}", name(place), angle(time_s));
        }
    }
    text
}

fn conditions(part: &Part) -> Vec<(&'static str, f64)> {
    let Conditions { pressure_pa, temperature_c } = part.conditions;
    let pressure = pressure_pa.map(|value| ("pressure_drop_pa", value));
    pressure.into_iter().chain(temperature_c.map(|value| ("oil_temperature_c", value))).collect()
}

/// To six digits, as people write numbers.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

fn name(place: usize) -> String {
    format!("next-{}", place + 1)
}

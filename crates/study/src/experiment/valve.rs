//! An experiment for a valve that is commanded: set-points in a scenario of its own.

use super::motion::Motion;
use super::within::{Conditions, Range, What};
use crate::sines::largest_amplitude;
use campaign::record;
use closed_loop::wire;
use config::{MotionLimits, Profile, Scenario, ScheduledSetPoint, SetPoint};
use diagnosis::Trial;
use std::f64::consts::TAU;
use toml::{Table, Value};
use valve_model::{FrictionLaw, Model};

/// At rest between motions, s; longer where the pressure is another.
const BETWEEN_S: f64 = 0.4;
const OTHER_PRESSURE_S: f64 = 1.5;
/// Sines, Hz and s; small ones in parts of the presliding range.
const SINES: [(f64, f64); 5] = [(0.5, 4.0), (1.0, 3.0), (3.0, 2.0), (8.0, 1.5), (20.0, 1.0)];
const SMALL: [f64; 3] = [0.5, 1.0, 3.0];
/// Ladders of steps, in parts of the room, with the rest before each step, s.
const LADDERS: [(f64, f64); 4] = [(1.0, 0.3), (0.2, 0.3), (0.02, 0.5), (0.2, 3.0)];
/// Steps of a ladder.
const STEPS: usize = 4;
/// Speeds without an end, in parts of the largest, and how long, s.
const SPEEDS: [f64; 4] = [0.01, 0.05, 0.3, 1.0];
const TURNING_S: f64 = 3.0;

/// A motion at conditions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    pub motion: Motion,
    pub conditions: Conditions,
}

/// Every motion that the scenario's limits allow.
pub fn parts(scenario: &Scenario, model: &Model, within: &[Range], sines: bool) -> Vec<Part> {
    let limits = &scenario.limits;
    let limit = |limit: Option<f64>| limit.map_or(TAU, |limit| (limit - scenario.initial_angle_rad).abs());
    let room_rad = 0.95 * limit(limits.min_angle_rad).min(limit(limits.max_angle_rad));
    let presliding_rad = FrictionLaw::new(&model.friction).break_away_deflection_rad();
    let mut motions = motions(limits, room_rad, presliding_rad);
    motions.retain(|motion| sines || !matches!(motion, Motion::Sine { .. }));
    let pressures: Vec<Option<f64>> = match within.iter().rev().find(|range| range.is_of(What::PressureDrop))
    {
        Some(range) => range.ends().map(Some).to_vec(),
        None => vec![None],
    };
    let at = |pressure_pa: Option<f64>| {
        let conditions = Conditions { pressure_pa, temperature_c: None };
        motions.iter().map(move |motion| Part { motion: *motion, conditions })
    };
    pressures.into_iter().flat_map(at).collect()
}

fn motions(limits: &MotionLimits, room_rad: f64, presliding_rad: f64) -> Vec<Motion> {
    let mut all = Vec::new();
    let speed_rad_per_s = limits.max_speed_rad_per_s;
    let acceleration_rad_per_s2 = limits.max_acceleration_rad_per_s2;
    let largest = |frequency_hz: f64| largest_amplitude(limits, frequency_hz).min(room_rad);
    for (frequency_hz, for_s) in SINES {
        for part in [1.0, 0.2] {
            all.push(Motion::Sine { amplitude_rad: part * largest(frequency_hz), frequency_hz, for_s });
        }
    }
    for part in SMALL {
        let amplitude_rad = part * presliding_rad;
        if amplitude_rad > 0.0 && amplitude_rad < largest(2.0) {
            all.push(Motion::Sine { amplitude_rad, frequency_hz: 2.0, for_s: 2.0 });
        }
    }
    for (part, rest_s) in LADDERS {
        let way_rad = part * room_rad;
        let for_s = STEPS as f64 * (rest_s + 2.0 * way_rad / speed_rad_per_s + 0.2);
        all.push(Motion::StartStop { rest_s, way_rad, speed_rad_per_s, acceleration_rad_per_s2, for_s });
    }
    if !limits.position_limited() {
        let turning = SPEEDS.map(|part| Motion::OneWay {
            speed_rad_per_s: part * speed_rad_per_s,
            acceleration_rad_per_s2,
            for_s: TURNING_S,
        });
        all.extend(turning);
    }
    all
}

/// The scenario with these motions in place of its own.
pub fn scenario(base: &Scenario, parts: &[Part]) -> Scenario {
    let mut made = base.clone();
    let home_rad = base.initial_angle_rad;
    let (mut time_s, mut set_points) = (BETWEEN_S, Vec::new());
    let own_pa = base.pressure_drop.at(0.0);
    let mut pressures: Vec<(f64, f64)> = Vec::new();
    for part in parts {
        let pressure_pa = part.conditions.pressure_pa.unwrap_or(own_pa);
        let before_pa = pressures.last().map(|point| point.1);
        if before_pa.is_some_and(|before_pa| before_pa != pressure_pa) {
            pressures.push((time_s, before_pa.unwrap_or(pressure_pa)));
            time_s += OTHER_PRESSURE_S;
        }
        if before_pa != Some(pressure_pa) {
            pressures.push((time_s, pressure_pa));
        }
        let mut at = |time_s: f64, set_point: SetPoint| {
            set_points.push(ScheduledSetPoint { time_s, set_point, line: 0 })
        };
        match part.motion {
            Motion::Sine { amplitude_rad, frequency_hz, .. } => {
                at(time_s, SetPoint::Sine { amplitude_rad, frequency_hz });
            }
            Motion::OneWay { speed_rad_per_s, .. } => at(time_s, SetPoint::Speed { speed_rad_per_s }),
            Motion::StartStop { way_rad, for_s, .. } | Motion::BothWays { way_rad, for_s, .. } => {
                for step in 0..STEPS {
                    let angle_rad = home_rad + if step % 2 == 0 { way_rad } else { -way_rad };
                    at(time_s + for_s * step as f64 / STEPS as f64, SetPoint::Angle { angle_rad });
                }
            }
        }
        time_s += part.motion.takes_s();
        let back = match part.motion {
            Motion::OneWay { .. } => SetPoint::Hold,
            _ => SetPoint::Angle { angle_rad: home_rad },
        };
        at(time_s, back);
        time_s += BETWEEN_S;
    }
    made.duration_s = time_s;
    made.set_points = set_points;
    if parts.iter().any(|part| part.conditions.pressure_pa.is_some()) {
        made.pressure_drop = Profile { points: pressures };
    }
    made
}

/// What a motion would be: the loop with the model as the valve, and its record.
pub fn trial(base: &Scenario, model: &Model, part: Part) -> Option<Trial> {
    let scenario = scenario(base, &[part]);
    let parts = wire(&scenario, model, model).ok()?;
    let mut run = record(&parts).runs.into_iter().next()?;
    // The angle is what is measured.
    run.torque_nm = None;
    let samples = run.len() as f64;
    Some(Trial { run, takes_s: scenario.duration_s, samples })
}

/// The scenario's file with other set-points, its models named from elsewhere.
///
/// # Errors
/// A text that is no TOML.
pub fn text(base: &str, made: &Scenario, models: (&str, &str), title: &str) -> anyhow::Result<String> {
    let mut table: Table = toml::from_str(base)?;
    let seconds = |value: f64| Value::String(format!("{}s", rounded(value)));
    let radians = |value: f64| Value::String(format!("{}rad", rounded(value)));
    let mut set = |key: &str, value: Value| drop(table.insert(key.to_owned(), value));
    set("name", Value::String(title.to_owned()));
    set("duration", seconds(made.duration_s));
    set("truth", Value::String(models.0.to_owned()));
    set("belief", Value::String(models.1.to_owned()));
    if made.pressure_drop.points.len() > 1 {
        let point = |(time_s, value): &(f64, f64)| {
            Value::Table(entries([
                ("time", seconds(*time_s)),
                ("value", Value::String(format!("{}Pa", rounded(*value)))),
            ]))
        };
        set("pressure_drop", Value::Array(made.pressure_drop.points.iter().map(point).collect()));
    }
    let set_points = made.set_points.iter().map(|of| {
        let (key, value) = match of.set_point {
            SetPoint::Angle { angle_rad } => ("angle", radians(angle_rad)),
            SetPoint::Speed { speed_rad_per_s } => {
                ("speed", Value::String(format!("{}rad/s", rounded(speed_rad_per_s))))
            }
            SetPoint::Sine { amplitude_rad, frequency_hz } => {
                let frequency = Value::String(format!("{frequency_hz}Hz"));
                (
                    "sine",
                    Value::Table(entries([("amplitude", radians(amplitude_rad)), ("frequency", frequency)])),
                )
            }
            // An experiment has no others.
            _ => ("hold", Value::Boolean(true)),
        };
        Value::Table(entries([("time", seconds(of.time_s)), (key, value)]))
    });
    set("set_point", Value::Array(set_points.collect()));
    Ok(toml::to_string(&table)?)
}

fn entries<const N: usize>(of: [(&str, Value); N]) -> Table {
    of.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

/// To seven digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

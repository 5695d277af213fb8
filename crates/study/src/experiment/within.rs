//! What an experiment must keep within: as far as the log went, and what the user says.

use super::motion::Bounds;
use anyhow::anyhow;
use config::{Dimension, parse_quantity};
use log_data::{Log, Run};
use prediction::Noise;
use valve_model::{FrictionLaw, Model};

/// A pressure that shows what pressure does, Pa, where the log has none to speak of.
const SOME_PRESSURE_PA: f64 = 10e6;
const LITTLE_PRESSURE_PA: f64 = 1e6;
/// Temperatures apart by less say nothing of temperature; it is then varied by so much, K.
const APART_K: f64 = 3.0;
const WARMER_K: f64 = 20.0;
/// Encoder steps, and deviations of its noise, that a motion must have to be seen.
const SEEN: f64 = 5.0;

/// A range that the user allows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    what: What,
    least: f64,
    most: f64,
}

impl Range {
    pub(super) fn is_of(&self, what: What) -> bool {
        self.what == what
    }

    /// Its ends; one where they are the same.
    pub(super) fn ends(&self) -> [f64; 2] {
        [self.least, self.most]
    }
}

/// What a range is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    Angle,
    Speed,
    Acceleration,
    PressureDrop,
    OilTemperature,
}

impl What {
    const ALL: [(Self, &'static str, Dimension); 5] = [
        (Self::Angle, "angle", Dimension::Angle),
        (Self::Speed, "speed", Dimension::Speed),
        (Self::Acceleration, "acceleration", Dimension::Acceleration),
        (Self::PressureDrop, "pressure_drop", Dimension::Pressure),
        (Self::OilTemperature, "oil_temperature", Dimension::Temperature),
    ];
}

/// Reads `pressure_drop=0MPa..16MPa`.
///
/// # Errors
/// What was found and expected.
pub fn range(text: &str) -> Result<Range, String> {
    let names = || What::ALL.map(|(_, name, _)| name).join(", ");
    let refused = || {
        format!("found `{text}`, expected one of {} with a range, such as pressure_drop=0MPa..16MPa", names())
    };
    let (name, range) = text.split_once('=').ok_or_else(refused)?;
    let (what, _, dimension) =
        What::ALL.into_iter().find(|(_, known, _)| *known == name.trim()).ok_or_else(refused)?;
    let (least, most) = range.split_once("..").ok_or_else(refused)?;
    let number = |text: &str| parse_quantity(text, dimension).map_err(|error| error.to_string());
    let (least, most) = (number(least)?, number(most)?);
    if least > most {
        return Err(format!("found `{range}`, expected the smaller value first"));
    }
    Ok(Range { what, least, most })
}

/// Conditions of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Conditions {
    pub pressure_pa: Option<f64>,
    pub temperature_c: Option<f64>,
}

/// What can be run on the machine that a log is of.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    pub bounds: Bounds,
    pub middle_rad: f64,
    pub conditions: Vec<Conditions>,
    /// Between samples, s.
    pub step_s: f64,
    /// Where the log's clock ends, s.
    pub ended_s: f64,
}

impl Machine {
    /// As far as the log went, within what the user allows.
    ///
    /// # Errors
    /// Where nothing is left to move in.
    pub fn of(log: &Log, model: &Model, within: &[Range]) -> anyhow::Result<Self> {
        let seen = Seen::of(log);
        let allowed = |what: What| within.iter().rev().find(|range| range.what == what);
        let (least, most) = allowed(What::Angle).map_or(seen.angle_rad, |range| (range.least, range.most));
        let most_of =
            |what: What, seen: f64| allowed(what).map_or(seen, |range| range.most.max(-range.least));
        let law = FrictionLaw::new(&model.friction);
        let bounds = Bounds {
            range_rad: most - least,
            speed_rad_per_s: most_of(What::Speed, seen.speed_rad_per_s),
            acceleration_rad_per_s2: most_of(What::Acceleration, seen.acceleration_rad_per_s2),
            presliding_rad: law.break_away_deflection_rad(),
            finest_rad: seen.finest_rad,
            step_s: seen.step_s,
        };
        if !(bounds.range_rad > 0.0 && bounds.speed_rad_per_s > 0.0 && bounds.acceleration_rad_per_s2 > 0.0) {
            return Err(anyhow!("--within: expected some angle, speed and acceleration to move with"));
        }
        let levels = |what: What, levels: Vec<f64>| match allowed(what) {
            Some(range) if range.least < range.most => vec![range.least, range.most],
            Some(range) => vec![range.most],
            None => levels,
        };
        let pressures = seen.pressure_pa.map(|seen| levels(What::PressureDrop, pressures(seen)));
        let temperatures = seen.temperature_c.map(|seen| levels(What::OilTemperature, temperatures(seen)));
        Ok(Self {
            bounds,
            middle_rad: 0.5 * (least + most),
            conditions: combined(pressures, temperatures),
            step_s: seen.step_s,
            ended_s: log.runs.iter().map(Run::end_s).fold(0.0, f64::max),
        })
    }
}

/// The pressures to measure at, Pa: none, and as much as there was.
fn pressures((least, most): (f64, f64)) -> Vec<f64> {
    let most = if most.abs().max(least.abs()) < LITTLE_PRESSURE_PA { SOME_PRESSURE_PA } else { most };
    vec![0.0, most]
}

/// The temperatures to measure at, °C.
fn temperatures((least, most): (f64, f64)) -> Vec<f64> {
    if most - least < APART_K { vec![least, least + WARMER_K] } else { vec![least, most] }
}

/// Every pressure with every temperature.
fn combined(pressures: Option<Vec<f64>>, temperatures: Option<Vec<f64>>) -> Vec<Conditions> {
    let each = |values: Option<Vec<f64>>| {
        values.map_or(vec![None], |values| values.into_iter().map(Some).collect::<Vec<_>>())
    };
    let temperatures = each(temperatures);
    each(pressures)
        .into_iter()
        .flat_map(|pressure_pa| {
            temperatures
                .iter()
                .map(move |temperature_c| Conditions { pressure_pa, temperature_c: *temperature_c })
        })
        .collect()
}

/// How far a log went.
struct Seen {
    angle_rad: (f64, f64),
    speed_rad_per_s: f64,
    acceleration_rad_per_s2: f64,
    /// Least and most, by the means of runs; none where a run lacks it.
    pressure_pa: Option<(f64, f64)>,
    temperature_c: Option<(f64, f64)>,
    step_s: f64,
    finest_rad: f64,
}

/// Samples over which speeds are taken: steps of the encoder are no speed.
const APART: usize = 10;

impl Seen {
    fn of(log: &Log) -> Self {
        let angles =
            || log.runs.iter().flat_map(|run| &run.angle_rad).copied().filter(|angle| angle.is_finite());
        let mut steps: Vec<f64> = log
            .runs
            .iter()
            .flat_map(|run| run.time_s.windows(2).take(1000))
            .map(|pair| pair.iter().fold(0.0, |before, after| after - before))
            .collect();
        let step_s = log_data::median(&mut steps).unwrap_or(1e-3);
        let mut speeds: Vec<f64> = log.runs.iter().flat_map(speeds).collect();
        let mut rises: Vec<f64> = log
            .runs
            .iter()
            .flat_map(|run| {
                let speeds: Vec<f64> = speeds_signed(run).collect();
                let apart_s = APART as f64 * step_s;
                (APART..speeds.len())
                    .map(|row| ((at(&speeds, row) - at(&speeds, row - APART)) / apart_s).abs())
                    .collect::<Vec<_>>()
            })
            .collect();
        let noise = log.runs.first().map(|run| Noise::of(&run.angle_rad));
        let finest_rad =
            noise.map_or(0.0, |noise| SEEN * noise.step_rad.max(noise.beyond_quantisation_rad()));
        Self {
            angle_rad: angles()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), angle| (a.min(angle), b.max(angle))),
            speed_rad_per_s: nearly_largest(&mut speeds),
            acceleration_rad_per_s2: nearly_largest(&mut rises),
            pressure_pa: means(log, |run| run.pressure_drop_pa.as_deref()),
            temperature_c: means(log, |run| run.oil_temperature_c.as_deref()),
            step_s,
            finest_rad,
        }
    }
}

fn at(values: &[f64], row: usize) -> f64 {
    values.get(row).copied().unwrap_or(f64::NAN)
}

fn speeds_signed(run: &Run) -> impl Iterator<Item = f64> + '_ {
    (APART..run.len()).map(|row| {
        (at(&run.angle_rad, row) - at(&run.angle_rad, row - APART))
            / (at(&run.time_s, row) - at(&run.time_s, row - APART))
    })
}

fn speeds(run: &Run) -> impl Iterator<Item = f64> + '_ {
    speeds_signed(run).map(f64::abs)
}

/// The largest but for one in a thousand, which outliers are.
fn nearly_largest(values: &mut Vec<f64>) -> f64 {
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    at(values, (0.999 * values.len().saturating_sub(1) as f64) as usize).max(0.0)
}

/// The least and the largest mean of a channel over runs; `None` where one lacks it.
fn means<'a>(log: &'a Log, channel: impl Fn(&'a Run) -> Option<&'a [f64]>) -> Option<(f64, f64)> {
    let mean = |run: &'a Run| {
        let known = channel(run)?.iter().filter(|value| value.is_finite());
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        (count > 0.0).then_some(sum / count)
    };
    let all: Option<Vec<f64>> = log.runs.iter().map(mean).collect();
    let all = all?;
    let least = all.iter().copied().fold(f64::INFINITY, f64::min);
    let most = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (!all.is_empty()).then_some((least, most))
}

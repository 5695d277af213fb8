//! What quantities can't be: pressures of some pascals, a temperature of millions of degrees.

use crate::finding::{Finding, Kind, Place, Severity, in_runs};
use crate::scale::{median, noise};
use log_data::{Channel, Log, Run};

/// No hydraulic pressure is so low, Pa, and yet stands out of its noise: a hundredth of a bar.
const LEAST_PA: f64 = 1000.0;
/// In bar the same would be that of a hydraulic circuit: from half a bar to a thousand.
const BAR: std::ops::Range<f64> = 0.05..1000.0;
/// A level that stands out of its noise so far is one.
const LEVEL: f64 = 5.0;
/// Oil is liquid between these, °C.
const OIL_C: std::ops::Range<f64> = -80.0..400.0;

pub(crate) fn inspect(log: &Log) -> Vec<Finding> {
    let mut found = Vec::new();
    if let Some(swapped) = swapped(log) {
        found.push(swapped);
    } else {
        found.extend(pressure(log));
    }
    found
}

/// A run's level of a channel, where there is one.
fn level(run: &Run, channel: Channel) -> Option<f64> {
    let values = run.channel(channel)?;
    let level = median(values.iter().map(|value| value.abs()));
    level.is_finite().then_some(level)
}

/// Whether a run's pressure can't be in pascals, but in bar.
fn is_in_bar(run: &Run) -> bool {
    let Some(values) = run.channel(Channel::PressureDrop) else { return false };
    let level = median(values.iter().map(|value| value.abs()));
    level < LEAST_PA && BAR.contains(&level) && level > LEVEL * noise(values)
}

fn is_a_pressure(run: &Run) -> bool {
    level(run, Channel::PressureDrop).is_some_and(|level| level >= LEAST_PA)
}

fn pressure(log: &Log) -> Option<Finding> {
    let names = |of: &dyn Fn(&Run) -> bool| -> Vec<String> {
        log.runs.iter().filter(|run| of(run)).map(|run| run.name.clone()).collect()
    };
    let (bar, pascal) = (names(&is_in_bar), names(&is_a_pressure));
    let first = log.runs.iter().find(|run| is_in_bar(run))?;
    let found = level(first, Channel::PressureDrop)?;
    let runs_differ = !pascal.is_empty();
    Some(Finding {
        kind: if runs_differ { Kind::RunsDiffer } else { Kind::PressureUnit },
        severity: Severity::Mistake,
        evidence: format!(
            "pressure_drop is {found:.3} Pa {}: less than a hundredth of a bar, and yet far above its noise{}",
            in_runs(&bar, log.runs.len()),
            if runs_differ { "; in others it is that of a hydraulic circuit" } else { "" }
        ),
        mend: "is it in bar? Then --map pressure_drop='...*1e5' (MPa: *1e6)".to_owned(),
        place: Place::of(&[Channel::PressureDrop], bar),
    })
}

/// A temperature that no oil has, beside a pressure that is one.
fn swapped(log: &Log) -> Option<Finding> {
    let odd = |run: &Run| {
        let (temperature, pressure) =
            (level(run, Channel::OilTemperature)?, level(run, Channel::PressureDrop)?);
        Some(!OIL_C.contains(&temperature) && OIL_C.contains(&pressure))
    };
    let runs: Vec<String> =
        log.runs.iter().filter(|run| odd(run) == Some(true)).map(|run| run.name.clone()).collect();
    let first = log.runs.iter().find(|run| odd(run) == Some(true))?;
    Some(Finding {
        kind: Kind::SwappedChannels,
        severity: Severity::Mistake,
        evidence: format!(
            "oil_temperature is {:.4e} degC and pressure_drop {:.4} Pa {}: each would make sense as the other",
            level(first, Channel::OilTemperature)?,
            level(first, Channel::PressureDrop)?,
            in_runs(&runs, log.runs.len())
        ),
        place: Place::of(&[Channel::OilTemperature, Channel::PressureDrop], runs),
        mend: "exchange the two columns".to_owned(),
    })
}

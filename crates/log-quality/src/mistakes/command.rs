//! What an angle log's angle is to its own command: turned, in other units, or none of its motion.

use super::table::DEGREES;
use crate::finding::{Finding, Kind, Place, Severity, in_runs};
use crate::scale::median;
use log_data::{Channel, Log, Run};
use prediction::Noise;
use std::f64::consts::{PI, TAU};
use valve_model::{Model, MotorParams};

/// How well a ratio of angle and command tells a unit.
const RATIO: f64 = 1.2;
/// A command that scatters so many times as much as its angle was measured, and the angle was not.
const SCATTERS: f64 = 10.0;

/// What an angle is to its own command: the same but for a lag.
pub(super) fn against_command(log: &Log, model: Option<&Model>) -> Vec<Finding> {
    let ratios: Vec<(&Run, f64, f64)> = log
        .runs
        .iter()
        .filter_map(|run| {
            let (ratio, correlation) = regression(run.channel(Channel::AngleCommand)?, &run.angle_rad)?;
            Some((run, ratio, correlation))
        })
        .collect();
    let most_lag_rad = model.and_then(|model| model.motor.as_ref()).map_or(0.0, most_lag_rad);
    let is = |ratio: f64, wanted: f64| ratio / wanted > 1.0 / RATIO && ratio / wanted < RATIO;
    let cases = [
        (
            Kind::AngleDirection,
            -1.0,
            "turns against its command",
            "is the encoder wired the other way? Then --map angle='-(...)'",
        ),
        (
            Kind::AngleUnit,
            DEGREES,
            "is 57.3 times its command",
            "is the angle in degrees, the command in radians? Then --map angle='...*pi/180'",
        ),
        (
            Kind::AngleUnit,
            1.0 / DEGREES,
            "is its command divided by 57.3",
            "is the command in degrees, the angle in radians? Then --map angle_command='...*pi/180'",
        ),
        (
            Kind::AngleUnit,
            1.0 / TAU,
            "is its command divided by 6.28",
            "is the angle in turns, the command in radians? Then --map angle='...*2*pi'",
        ),
        (
            Kind::AngleUnit,
            TAU,
            "is 6.28 times its command",
            "is the command in turns, the angle in radians? Then --map angle_command='...*2*pi'",
        ),
    ];
    for (kind, wanted, says, mend) in cases {
        let runs: Vec<String> = ratios
            .iter()
            .filter(|(_, ratio, correlation)| is(*ratio, wanted) && correlation.abs() > 0.9)
            .filter(|(run, ..)| lag_range_rad(run) > most_lag_rad)
            .map(|(run, ..)| run.name.clone())
            .collect();
        if runs.is_empty() || 10 * runs.len() < ratios.len() {
            continue;
        }
        let differ = ratios.iter().filter(|(_, ratio, _)| is(*ratio, 1.0)).count() > 0;
        return vec![Finding {
            kind: if differ { Kind::RunsDiffer } else { kind },
            severity: Severity::Mistake,
            evidence: format!("the angle {says} {}", in_runs(&runs, log.runs.len())),
            place: Place::of(&[Channel::Angle, Channel::AngleCommand], runs),
            mend: mend.to_owned(),
        }];
    }
    let strange: Vec<String> = ratios
        .iter()
        .filter(|(.., correlation)| correlation.abs() < 0.5)
        .map(|(run, ..)| run.name.clone())
        .collect();
    if ratios.is_empty() || 2 * strange.len() <= ratios.len() {
        return Vec::new();
    }
    vec![Finding {
        kind: Kind::WrongAngle,
        severity: Severity::Mistake,
        evidence: format!("the angle doesn't follow its command {}", in_runs(&strange, log.runs.len())),
        place: Place::of(&[Channel::Angle, Channel::AngleCommand], strange),
        mend: "is the angle's column the right one?".to_owned(),
    }]
}

/// The command's noise, rad, if in every run it scatters much more than the angle. A command is computed: its steps may be coarse, but it
/// doesn't scatter.
pub(super) fn noisier_command_rad(log: &Log) -> Option<f64> {
    let scatter = |run: &Run| {
        let scatter = Noise::of(run.channel(Channel::AngleCommand)?).beyond_quantisation_rad();
        (scatter > SCATTERS * Noise::of(&run.angle_rad).deviation_rad).then_some(scatter)
    };
    let all: Vec<f64> = log.runs.iter().map(scatter).collect::<Option<_>>()?;
    (!all.is_empty()).then(|| median(all.into_iter()))
}

/// How far a rotor's lag may range before it loses steps, rad: 90° electrical either way. Friction may hold it back by that in a short
/// motion.
fn most_lag_rad(motor: &MotorParams) -> f64 {
    PI / f64::from(motor.rotor_teeth)
}

/// From the least to the largest of command less angle, rad.
fn lag_range_rad(run: &Run) -> f64 {
    let command = run.channel(Channel::AngleCommand).unwrap_or_default();
    let lag = command.iter().zip(&run.angle_rad).map(|(command, angle)| command - angle);
    let (least, most) = lag
        .filter(|lag| lag.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), lag| (least.min(lag), most.max(lag)));
    most - least
}

/// Slope and correlation of a channel on another; `None` where one hardly varies or little is known.
fn regression(x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    let pairs = || x.iter().zip(y).filter(|(x, y)| x.is_finite() && y.is_finite());
    let count = pairs().count() as f64;
    let (x_sum, y_sum) = pairs().fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
    let (x_mean, y_mean) = (x_sum / count, y_sum / count);
    let (xx, yy, xy) = pairs().fold((0.0, 0.0, 0.0), |(xx, yy, xy), (x, y)| {
        let (x, y) = (x - x_mean, y - y_mean);
        (xx + x * x, yy + y * y, xy + x * y)
    });
    (count > 20.0 && xx > 0.0 && yy > 0.0).then(|| (xy / xx, xy / (xx * yy).sqrt()))
}

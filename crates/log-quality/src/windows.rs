//! Stretches of runs, their motion told from the angle: enough of each run to judge its units by.

use log_data::{AngleZero, Channel, Log, Run};
use prediction::{Noise, Smoother};
use valve_model::MotionSample;

/// Rows of a stretch.
const ROWS: usize = 4000;
/// Rows of all stretches together, about: more would say the same.
const ALL_ROWS: usize = 60_000;

/// A stretch of a run.
pub(crate) struct Window {
    /// The run's place in the log.
    pub(crate) run: usize,
    /// Time of its first sample, s.
    pub(crate) begin_s: f64,
    /// Time between samples, s.
    pub(crate) interval_s: f64,
    pub(crate) motions: Vec<MotionSample>,
    /// What is held against the model: the torque, or command less angle.
    pub(crate) measured: Vec<f64>,
}

/// What a window's motion and measurement are taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Source {
    /// The channel taken for the angle.
    pub(crate) angle: Channel,
    /// The channel taken for the torque; the command of an angle log.
    pub(crate) measured: Channel,
    /// Whether the angle is the integral of its channel: a speed.
    pub(crate) integrated: bool,
    /// Whether what is measured is what the angle lags behind.
    pub(crate) lag: bool,
}

/// The stretches of all runs that have both channels.
pub(crate) fn windows(log: &Log, source: Source) -> Vec<Window> {
    let windows = |(index, run)| of_run(log, index, run, source);
    log.runs.iter().enumerate().flat_map(windows).collect()
}

fn of_run(log: &Log, index: usize, run: &Run, source: Source) -> Vec<Window> {
    let (zero, runs) = (log.angle_zero, log.runs.len());
    let (Some(angle), Some(measured)) = (run.channel(source.angle), run.channel(source.measured)) else {
        return Vec::new();
    };
    let rows = run.len();
    let stretches = ALL_ROWS.div_ceil(ROWS * runs).max(1);
    let whole = rows <= ROWS * stretches;
    let length = if whole { rows } else { ROWS };
    let starts: Vec<usize> = if whole {
        vec![0]
    } else {
        (0..stretches).map(|stretch| (2 * stretch + 1) * (rows - ROWS) / (2 * stretches)).collect()
    };
    let window = |start: usize| {
        let part = start..start + length;
        let (time_s, angle) = (run.time_s.get(part.clone())?, angle.get(part.clone())?);
        let mut angle_rad = bridged(angle)?;
        if source.integrated {
            angle_rad = integral(time_s, &angle_rad);
        }
        let measured = measured.get(part)?.to_vec();
        let measured = if source.lag { lag(zero, &measured, &angle_rad) } else { measured };
        let noise = Noise::of(&angle_rad);
        let mut smoother = Smoother::new(time_s, &angle_rad, noise);
        let motions = (0..time_s.len()).map(|row| smoother.motion(row)).collect();
        let steps = time_s.len().saturating_sub(1).max(1) as f64;
        let interval_s = (time_s.last()? - time_s.first()?) / steps;
        let begin_s = *time_s.first()?;
        Some(Window { run: index, begin_s, interval_s, motions, measured })
    };
    starts.into_iter().filter_map(window).filter(|window| window.motions.len() > 20).collect()
}

/// Command less angle; where each run has a zero of its own, about its mean.
fn lag(zero: AngleZero, command: &[f64], angle_rad: &[f64]) -> Vec<f64> {
    let lag: Vec<f64> = command.iter().zip(angle_rad).map(|(command, angle)| command - angle).collect();
    let (sum, count) = lag
        .iter()
        .filter(|lag| lag.is_finite())
        .fold((0.0, 0.0), |(sum, count), lag| (sum + lag, count + 1.0));
    let mean = if zero == AngleZero::PerRun && count > 0.0 { sum / count } else { 0.0 };
    lag.into_iter().map(|lag| lag - mean).collect()
}

/// Angles without missing ones; `None` where half of them are missing.
fn bridged(angle: &[f64]) -> Option<Vec<f64>> {
    let known = angle.iter().filter(|angle| angle.is_finite()).count();
    if 2 * known < angle.len() {
        return None;
    }
    let mut last = angle.iter().copied().find(|angle| angle.is_finite())?;
    let mut hold = |angle: &f64| {
        last = if angle.is_finite() { *angle } else { last };
        last
    };
    Some(angle.iter().map(&mut hold).collect())
}

fn integral(time_s: &[f64], speed: &[f64]) -> Vec<f64> {
    let (mut sum, mut before) = (0.0, None);
    let step = |(time, speed): (&f64, &f64)| {
        if let Some((time_before, speed_before)) = before.replace((*time, *speed)) {
            sum += 0.5 * (speed + speed_before) * (time - time_before);
        }
        sum
    };
    time_s.iter().zip(speed).map(step).collect()
}

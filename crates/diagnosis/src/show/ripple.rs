//! Tests if the phase of a ripple over the angle is the same at all speeds, as it must be for a torque that depends on
//! the angle alone.

use crate::extend::hypothesis::Member;
use crate::log::campaign::Campaign;
use crate::show::residual::PieceResidual;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use valve_model::EffectId;

/// Number of speed classes (signed), and least periods of the ripple in each.
const SPEEDS: usize = 6;
const PERIODS: f64 = 3.0;
/// The part of a period that counts as a whole one, and the least span of speeds relative to the fastest.
const GONE_THROUGH: f64 = 0.7;
const APART: f64 = 0.5;
/// Least number of neighbouring samples that count as one independent sample.
const NEIGHBOURS: f64 = 6.0;
/// Significance level, and least drift of the phase that is reported, rad.
const CHANCE: f64 = 1e-3;
const DRIFT_RAD: f64 = 0.2;

/// A sample: angle, speed, and the torque that the ripple has to explain, with the weight of the fit.
#[derive(Debug, Clone, Copy)]
struct Sample {
    run: usize,
    angle_rad: f64,
    speed_rad_per_s: f64,
    torque_nm: f64,
    weight: f64,
}

/// The ripple's phase in a class of samples.
#[derive(Debug, Clone, Copy)]
struct Phase {
    speed_rad_per_s: f64,
    phase_rad: f64,
    error_rad: f64,
}

/// Whether and how the phase of a ripple over the angle drifts.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Drift {
    /// In words.
    pub text: String,
    /// Whether the phase differs between speeds or between runs: a torque that depends on the angle alone has one.
    pub drifts: bool,
}

/// How the phase of the largest harmonic of a `position-torque` depends on speed and differs from run to run; `None` for other causes, or
/// if it can't be determined. `after` is the residual of the whole hypothesis, of which `per_independent` samples count as one.
pub(crate) fn phase(
    campaign: &Campaign,
    member: &Member,
    after: &[PieceResidual],
    per_independent: f64,
) -> Option<Drift> {
    if member.candidate.id != EffectId::PositionTorque || !campaign.kind.residual_is_torque() {
        return None;
    }
    let of = |number: usize| member.numbers.get(number).copied().unwrap_or(0.0);
    let amplitude = |order: &usize| of(2 * (order - 1)).hypot(of(2 * order - 1));
    let order = (1..=member.numbers.len() / 2).max_by(|a, b| amplitude(a).total_cmp(&amplitude(b)))?;
    let ripple = |angle_rad: f64| {
        let (sin, cos) = (order as f64 * angle_rad).sin_cos();
        of(2 * (order - 1)) * cos + of(2 * order - 1) * sin
    };
    let alike = per_independent.max(NEIGHBOURS);
    let by_speed = words(&at_speeds(samples(campaign, after, ripple), order, alike), order);
    if by_speed.as_ref().is_some_and(|of| of.drifts) {
        return by_speed;
    }
    from_run_to_run(&samples(campaign, after, ripple), order, alike).or(by_speed)
}

/// The phase in classes of speed. A sample's speed is the mean over the period of the ripple that it lies in: where a drive
/// yields to the ripple, its instantaneous speed varies with the angle.
fn at_speeds(mut samples: Vec<Sample>, order: usize, alike: f64) -> Vec<Phase> {
    by_period(&mut samples, order);
    samples.retain(|sample| sample.speed_rad_per_s.is_finite());
    samples.sort_by(|a, b| a.speed_rad_per_s.total_cmp(&b.speed_rad_per_s));
    let classes = samples.chunks(samples.len().div_ceil(SPEEDS).max(1));
    let phases: Vec<Phase> = classes.filter_map(|some| fitted(some, order as f64, alike)).collect();
    let speeds = || phases.iter().map(|of| of.speed_rad_per_s);
    let most = speeds().map(f64::abs).fold(0.0, f64::max);
    let span = speeds().fold(f64::NEG_INFINITY, f64::max) - speeds().fold(f64::INFINITY, f64::min);
    // At one speed a phase can't drift with it.
    if span > APART * most { phases } else { Vec::new() }
}

/// Gives the samples of each period of the ripple their mean speed; NaN if a period is not passed as a whole.
fn by_period(samples: &mut [Sample], order: usize) {
    let period_rad = std::f64::consts::TAU / order as f64;
    let place = |sample: &Sample| (sample.run, (sample.angle_rad / period_rad).floor() as i64);
    for period in samples.chunk_by_mut(|a, b| place(a) == place(b)) {
        let mean = period.iter().map(|of| of.speed_rad_per_s).sum::<f64>() / period.len() as f64;
        let ends = period.first().zip(period.last());
        let turned = ends.map_or(0.0, |(first, last)| (last.angle_rad - first.angle_rad).abs());
        let speed = if turned > GONE_THROUGH * period_rad { mean } else { f64::NAN };
        period.iter_mut().for_each(|of| of.speed_rad_per_s = speed);
    }
}

/// The phase's drift from run to run, in words; `None` if there is none.
fn from_run_to_run(samples: &[Sample], order: usize, alike: f64) -> Option<Drift> {
    let runs = samples.chunk_by(|a, b| a.run == b.run);
    let phases: Vec<Phase> = runs.filter_map(|some| fitted(some, order as f64, alike)).collect();
    let (p_value, off) = scatter(&phases)?;
    let span = span(&off);
    (p_value < CHANCE && span.1 - span.0 > DRIFT_RAD).then(|| Drift {
        text: format!(
            "the phase of the ripple {} differs from run to run, by {:.0}° over {} runs: their angles have no common zero, or it is none of the angle alone",
            times_per_turn(order),
            (span.1 - span.0).to_degrees(),
            phases.len()
        ),
        drifts: true,
    })
}

fn samples(campaign: &Campaign, after: &[PieceResidual], ripple: impl Fn(f64) -> f64) -> Vec<Sample> {
    let mut found = Vec::new();
    for (piece, left) in campaign.pieces.iter().zip(after) {
        for (index, (residual, weight)) in left.residual.iter().zip(&piece.weights).enumerate() {
            let (angle_rad, speed_rad_per_s, _) = piece.kinematics(index);
            if *weight > 0.0 && angle_rad.is_finite() {
                let torque_nm = residual + ripple(angle_rad);
                found.push(Sample { run: piece.run, angle_rad, speed_rad_per_s, torque_nm, weight: *weight });
            }
        }
    }
    found
}

/// Fits cosine and sine. The error follows from the residual, of which `alike` samples count as one independent sample.
fn fitted(samples: &[Sample], order: f64, alike: f64) -> Option<Phase> {
    let (mut cc, mut cs, mut ss, mut yc, mut ys, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut speed, mut travel) = (0.0, 0.0);
    let (mut sum, mut weights) = (0.0, 0.0);
    for sample in samples {
        sum += sample.weight * sample.weight * sample.torque_nm;
        weights += sample.weight * sample.weight;
    }
    let mean = sum / weights;
    for sample in samples {
        let (sin, cos) = (order * sample.angle_rad).sin_cos();
        let square = sample.weight * sample.weight;
        let torque = sample.torque_nm - mean;
        (cc, cs, ss) = (cc + square * cos * cos, cs + square * cos * sin, ss + square * sin * sin);
        (yc, ys, yy) =
            (yc + square * torque * cos, ys + square * torque * sin, yy + square * torque * torque);
        speed += sample.speed_rad_per_s / samples.len() as f64;
        travel += 1.0;
    }
    let determinant = cc * ss - cs * cs;
    if travel < 100.0 || determinant <= 0.1 * cc * ss {
        return None;
    }
    let (a, b) = ((ss * yc - cs * ys) / determinant, (cc * ys - cs * yc) / determinant);
    let left = (yy - a * yc - b * ys).max(0.0) / travel;
    // In white noise an amplitude's variance is 2·left/(weight of all samples).
    let error = (alike * 2.0 * left / (cc + ss)).sqrt();
    let amplitude = a.hypot(b);
    let periods = samples.iter().map(|of| (of.angle_rad * order / std::f64::consts::TAU) as i64);
    let span = periods.clone().max()? - periods.min()?;
    ((span as f64) >= PERIODS && amplitude > 3.0 * error).then(|| Phase {
        speed_rad_per_s: speed,
        phase_rad: b.atan2(a),
        error_rad: error / amplitude,
    })
}

/// The p-value of the phases' scatter (χ²), and each one's distance from their mean, rad; `None` for fewer than three.
fn scatter(phases: &[Phase]) -> Option<(f64, Vec<f64>)> {
    if phases.len() < 3 {
        return None;
    }
    let sum = phases.iter().fold((0.0, 0.0), |sum, of| {
        let weight = 1.0 / (of.error_rad * of.error_rad);
        (sum.0 + weight * of.phase_rad.cos(), sum.1 + weight * of.phase_rad.sin())
    });
    let mean = sum.1.atan2(sum.0);
    let off = |of: &Phase| {
        (of.phase_rad - mean + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI
    };
    let statistic: f64 = phases.iter().map(|of| (off(of) / of.error_rad).powi(2)).sum();
    let p_value = ChiSquared::new(phases.len() as f64 - 1.0).map_or(1.0, |chi| 1.0 - chi.cdf(statistic));
    Some((p_value, phases.iter().map(off).collect()))
}

fn span(off: &[f64]) -> (f64, f64) {
    off.iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |span, value| (span.0.min(*value), span.1.max(*value)))
}

/// How often in a turn, in words.
pub(crate) fn times_per_turn(order: usize) -> String {
    match order {
        1 => "once per turn".to_owned(),
        2 => "twice per turn".to_owned(),
        _ => format!("{order} times per turn"),
    }
}

fn words(phases: &[Phase], order: usize) -> Option<Drift> {
    let (first, last) = (phases.first()?, phases.last()?);
    let (p_value, off) = scatter(phases)?;
    let (least, most) = span(&off);
    let times = times_per_turn(order);
    if p_value > CHANCE || most - least < DRIFT_RAD {
        let text = format!(
            "the ripple {times} has the same phase at all speeds, {:.0} to {:.0} rad/s, within ±{:.0}°",
            first.speed_rad_per_s,
            last.speed_rad_per_s,
            0.5 * (most - least).to_degrees()
        );
        return Some(Drift { text, drifts: false });
    }
    let list: Vec<String> = phases
        .iter()
        .zip(&off)
        .map(|(of, off)| format!("{:+.0}° at {:.0} rad/s", off.to_degrees(), of.speed_rad_per_s))
        .collect();
    let text = format!(
        "the phase of the ripple {times} drifts with speed ({}): beside a torque over the angle something follows it late, \
         or swings with it",
        list.join(", ")
    );
    Some(Drift { text, drifts: true })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A ripple whose phase is the speed times `late_s`.
    fn found(late_s: f64) -> String {
        let mut phases = Vec::new();
        for speed_rad_per_s in [-20.0, -10.0, 10.0, 20.0] {
            let samples: Vec<Sample> = (0..4000)
                .map(|k| {
                    let angle_rad = speed_rad_per_s * 1e-3 * f64::from(k);
                    let noise = 0.2 * (1e4 * (f64::from(k) * 0.7).sin()).fract();
                    let torque_nm = (angle_rad - late_s * speed_rad_per_s).cos() + noise;
                    Sample { run: 0, angle_rad, speed_rad_per_s, torque_nm, weight: 1.0 }
                })
                .collect();
            phases.extend(fitted(&samples, 1.0, NEIGHBOURS));
        }
        words(&phases, 1).unwrap().text
    }

    #[test]
    fn a_ripple_that_comes_late_drifts_and_one_of_the_angle_does_not() {
        assert!(found(0.0).contains("same phase at all speeds"), "{}", found(0.0));
        assert!(found(0.02).contains("drifts with speed (-23° at -20 rad/s"), "{}", found(0.02));
    }
}

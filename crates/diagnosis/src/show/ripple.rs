//! Tests if the phase of a ripple over the angle is the same at all speeds, as it must be for a torque that depends on
//! the angle alone.

use crate::log::campaign::Campaign;
use crate::outcome::Cause;
use crate::show::residual::Left;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use valve_model::EffectId;

/// Number of speed classes (signed), and least periods of the ripple in each.
const SPEEDS: usize = 6;
const PERIODS: f64 = 3.0;
/// Significance level, and least drift of the phase that is reported, rad.
const CHANCE: f64 = 1e-3;
const DRIFT_RAD: f64 = 0.2;

/// A sample: angle, speed, and the torque that the ripple has to explain, with the weight of the fit.
#[derive(Debug, Clone, Copy)]
struct Sample {
    angle_rad: f64,
    speed_rad_per_s: f64,
    torque_nm: f64,
    weight: f64,
}

/// The ripple at some speed.
#[derive(Debug, Clone, Copy)]
struct Phase {
    speed_rad_per_s: f64,
    phase_rad: f64,
    error_rad: f64,
}

/// A sentence on the phase of the largest harmonic of `position-torque`; `None` for other causes, or if too few speeds
/// show it.
pub(crate) fn phase(campaign: &Campaign, cause: &Cause, after: &[Left]) -> Option<String> {
    if cause.id != EffectId::PositionTorque || !campaign.kind.motion_is_measured {
        return None;
    }
    let of = |key: &str, order: usize| {
        cause.parameters.get(&format!("{key}[{order}]")).map_or(0.0, |found| found.value)
    };
    let greatest = |a: &usize, b: &usize| {
        of("cos", *a).hypot(of("sin", *a)).total_cmp(&of("cos", *b).hypot(of("sin", *b)))
    };
    let order = (1..=64).max_by(greatest)?;
    let ripple = |angle_rad: f64| {
        let (sin, cos) = (order as f64 * angle_rad).sin_cos();
        of("cos", order) * cos + of("sin", order) * sin
    };
    let mut samples = samples(campaign, after, ripple);
    samples.sort_by(|a, b| a.speed_rad_per_s.total_cmp(&b.speed_rad_per_s));
    let phases: Vec<Phase> = samples
        .chunks(samples.len().div_ceil(SPEEDS).max(1))
        .filter_map(|some| at_a_speed(some, order as f64))
        .collect();
    words(&phases, order)
}

fn samples(campaign: &Campaign, after: &[Left], ripple: impl Fn(f64) -> f64) -> Vec<Sample> {
    let mut found = Vec::new();
    for (piece, left) in campaign.pieces.iter().zip(after) {
        for (index, (residual, weight)) in left.residual.iter().zip(&piece.weights).enumerate() {
            let (angle_rad, speed_rad_per_s, _) = piece.kinematics(index);
            if *weight > 0.0 && angle_rad.is_finite() {
                let torque_nm = residual + ripple(angle_rad);
                found.push(Sample { angle_rad, speed_rad_per_s, torque_nm, weight: *weight });
            }
        }
    }
    found
}

/// Fits cosine and sine; the error follows from the residual, where samples within a sixth of a period count as one.
fn at_a_speed(samples: &[Sample], order: f64) -> Option<Phase> {
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
    // In white noise an amplitude's variance is 2·left/(weight of all samples); neighbours are worth a sixth of themselves.
    let error = (6.0 * 2.0 * left / (cc + ss)).sqrt();
    let amplitude = a.hypot(b);
    let periods = samples.iter().map(|of| (of.angle_rad * order / std::f64::consts::TAU) as i64);
    let span = periods.clone().max()? - periods.min()?;
    ((span as f64) >= PERIODS && amplitude > 3.0 * error).then(|| Phase {
        speed_rad_per_s: speed,
        phase_rad: b.atan2(a),
        error_rad: error / amplitude,
    })
}

fn words(phases: &[Phase], order: usize) -> Option<String> {
    let (first, last) = (phases.first()?, phases.last()?);
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
    let (least, most) = phases
        .iter()
        .map(off)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |span, value| (span.0.min(value), span.1.max(value)));
    let times = if order == 1 { "once per turn".to_owned() } else { format!("{order} times per turn") };
    if p_value > CHANCE || most - least < DRIFT_RAD {
        return Some(format!(
            "the ripple {times} has the same phase at all speeds, {:.0} to {:.0} rad/s, within ±{:.0}°",
            first.speed_rad_per_s,
            last.speed_rad_per_s,
            0.5 * (most - least).to_degrees()
        ));
    }
    let list: Vec<String> = phases
        .iter()
        .map(|of| format!("{:+.0}° at {:.0} rad/s", off(of).to_degrees(), of.speed_rad_per_s))
        .collect();
    Some(format!(
        "the phase of the ripple {times} drifts with speed ({}): beside a torque over the angle something follows it late, \
         or swings with it",
        list.join(", ")
    ))
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
                    Sample { angle_rad, speed_rad_per_s, torque_nm, weight: 1.0 }
                })
                .collect();
            phases.extend(at_a_speed(&samples, 1.0));
        }
        words(&phases, 1).unwrap()
    }

    #[test]
    fn a_ripple_that_comes_late_drifts_and_one_of_the_angle_does_not() {
        assert!(found(0.0).contains("same phase at all speeds"), "{}", found(0.0));
        assert!(found(0.02).contains("drifts with speed (-23° at -20 rad/s"), "{}", found(0.02));
    }
}

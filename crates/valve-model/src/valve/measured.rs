//! A step along a motion that is known by its angles: between two samples the contact turns by what the angles say, whatever
//! the speeds at its ends add up to.
//!
//! Speeds of sampled angles are means over two intervals. Where a spool sets out, stops or turns round within a sample, a contact that
//! followed them alone would move a sample early, and bristles would carry the torque of it.

use super::motion::{MotionInput, MotionOutput, MotionParams, MotionSample, MotionState, motion_step};

/// A turn that the speeds miss by less than so many of the angles' standard deviations may be noise: it isn't followed.
const NOISE: f64 = 3.0;
/// A turn that the speeds miss by less than this part of the length over which bristles take up the Coulomb torque changes the
/// torque by no more than the same part, less than a transducer resolves.
const HARDLY: f64 = 1e-3;

/// Moves a contact through `dt_s` of a motion whose angles were measured with an error of `deviation_rad`, standard deviation.
/// The speed goes linearly to the middle and from there to the end, so that the turn is that of the angles. Without bristles,
/// where speeds alone count, and behind a spring, whose far end follows the angles anyway, it is [`motion_step`].
pub fn measured_motion_step(
    params: &MotionParams,
    state: &mut MotionState,
    (input, deviation_rad): (&MotionInput, f64),
    dt_s: f64,
) -> MotionOutput {
    let least_rad = (NOISE * deviation_rad).max(HARDLY * params.friction_law().slip_length_rad());
    let Some([start, middle, end]) = way(params, input, least_rad, dt_s) else {
        return motion_step(params, state, input, dt_s);
    };
    motion_step(params, state, &MotionInput { start, end: middle, ..*input }, 0.5 * dt_s);
    motion_step(params, state, &MotionInput { start: middle, end, ..*input }, 0.5 * dt_s)
}

/// The motion at the beginning, in the middle and at the end; `None` where the speeds at the ends add up to the turn, to less
/// than `least_rad`.
fn way(params: &MotionParams, input: &MotionInput, least_rad: f64, dt_s: f64) -> Option<[MotionSample; 3]> {
    if params.is_behind_a_spring() || params.friction_law().break_away_deflection_rad() == 0.0 {
        return None;
    }
    let (start, end) = (&input.start, &input.end);
    let turn_rad = end.angle_rad - start.angle_rad;
    let missed_rad = turn_rad - 0.5 * (start.speed_rad_per_s + end.speed_rad_per_s) * dt_s;
    if !missed_rad.is_finite() || missed_rad.abs() <= least_rad {
        return None;
    }
    let (middle, ends) = between(start, end, dt_s);
    let at = |sample: &MotionSample, speed_rad_per_s: f64| MotionSample { speed_rad_per_s, ..*sample };
    Some([at(start, ends.0), middle, at(end, ends.1)])
}

/// The motion half-way in time between two samples, and the speeds at them that go with it: the speed is linear to the middle
/// and from there on, and the turn is that of the angles.
fn between(start: &MotionSample, end: &MotionSample, dt_s: f64) -> (MotionSample, (f64, f64)) {
    let mean = (end.angle_rad - start.angle_rad) / dt_s;
    let ends = one_way((start.speed_rad_per_s, end.speed_rad_per_s), mean);
    let speed_rad_per_s = 2.0 * mean - 0.5 * (ends.0 + ends.1);
    let middle = MotionSample {
        angle_rad: start.angle_rad + 0.25 * dt_s * (ends.0 + speed_rad_per_s),
        speed_rad_per_s,
        acceleration_rad_per_s2: 0.5 * (start.acceleration_rad_per_s2 + end.acceleration_rad_per_s2),
    };
    (middle, ends)
}

/// What [`measured_motion_step`] takes for the motion half-way in time between two samples that are `dt_s` apart.
pub fn half_way(start: &MotionSample, end: &MotionSample, dt_s: f64) -> MotionSample {
    between(start, end, dt_s).0
}

/// The speeds at the ends of a step of this mean speed, held so low that a spool that goes one way, or rests at one end, doesn't
/// turn round within the step (the condition of a monotone curve: Fritsch and Carlson, SIAM J. Numer. Anal. 17, 1980, for two
/// straight pieces).
fn one_way(speeds: (f64, f64), mean: f64) -> (f64, f64) {
    if speeds.0 * speeds.1 < 0.0 {
        return speeds;
    }
    let held = |speed: f64| (speed * mean.signum()).max(0.0).min(2.0 * mean.abs()) * mean.signum();
    (held(speeds.0), held(speeds.1))
}

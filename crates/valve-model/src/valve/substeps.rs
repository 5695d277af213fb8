//! A control cycle in sub-steps: their lengths by the error of [`super::rodas`], their ends at changes of direction.
//!
//! The cost of a cycle is bounded: after a fixed number of attempts its rest is left to a first-order method that is
//! stable for any parameters ([`super::robust`]). Everything is deterministic.

use super::crossing::Course;
use super::linear::Jacobian;
use super::pace::Pace;
use super::robust;
use super::rodas::{self, Trial};
use super::shaft::{Shaft, ShaftState};
use super::tolerance::{ANGLE_TOLERANCE, DAMPING_TOLERANCE, SPEED_TOLERANCE, TORQUE_TOLERANCE};
use crate::FrictionState;
use crate::friction::{Law, sign};

/// Attempts at a sub-step in one cycle.
const ATTEMPTS: usize = 512;
/// Attempts where errors as large as a measurement's noise are accepted. Ordinary laws then take 64 at the most in all but one of 10,000 cycles. A
/// law that jumps with the speed's sign chatters around rest, and takes all that it is given.
const COARSE_ATTEMPTS: usize = 128;
/// Sub-steps of the robust method, for what the attempts left of a cycle.
const ROBUST_SUBSTEPS: usize = 4;
/// How far the spool may go with the wrong sign of its speed, rad.
const TURN_TOLERANCE: f64 = 2e-11;

/// Moves `state` through `dt_s`, from the beginning of the shaft's cycle; `next_s` is the length of the next sub-step,
/// carried from cycle to cycle.
pub(super) fn integrate<L: Law, const FULL: bool>(
    shaft: &mut Shaft<'_, L, FULL>,
    mut state: ShaftState<FULL>,
    friction: &mut FrictionState,
    dt_s: f64,
    next_s: &mut f64,
) -> ShaftState<FULL> {
    let scales = Scales::new(shaft.law, shaft.params.coarseness);
    let mut pace = Pace::new(*next_s, dt_s);
    let mut time_s = 0.0;
    let (mut begin, mut landing_s, mut turned) = (None, None, false);
    shaft.direction = sign(state.speed);
    let attempts = if shaft.params.coarseness > 1.0 { COARSE_ATTEMPTS } else { ATTEMPTS };
    for _ in 0..attempts {
        let left_s = dt_s - time_s;
        if left_s <= 0.0 || pace.is_too_short() {
            break;
        }
        let step_s = landing_s.unwrap_or_else(|| pace.step_s(left_s));
        if shaft.foresee(&state, (time_s, step_s), friction) {
            begin = None;
        }
        let jacobian = &*begin.get_or_insert_with(|| Jacobian::new(shaft, &state, time_s, &friction.memory));
        let change = step_s * jacobian.rates.speed;
        let trial = rodas::attempt(shaft, &state, jacobian, (time_s, step_s), &friction.memory);
        let landing = landing_s.take().is_some();
        let Some(trial) = trial else {
            pace.reject_hopeless(step_s);
            continue;
        };
        let error = scales.size(&trial.error);
        if error > 1.0 {
            pace.reject(step_s, error);
            continue;
        }
        match next_turn(&trial, shaft.direction, step_s, change) {
            Some(0.0) if turned => {}
            Some(0.0) => {
                (shaft.direction, turned, begin) = (-shaft.direction, true, None);
                continue;
            }
            Some(turn_s) => {
                landing_s = Some(turn_s);
                continue;
            }
            None => {}
        }
        shaft.accept(&state, &trial.end, step_s, friction);
        state = trial.end;
        (begin, turned) = (None, false);
        if state.speed * shaft.direction <= 0.0 {
            shaft.direction = -shaft.direction;
        }
        time_s = if step_s == left_s { dt_s } else { time_s + step_s };
        pace.accept(step_s, error, landing);
    }
    if time_s < dt_s {
        state = robust::integrate(shaft, state, friction, (time_s, dt_s), ROBUST_SUBSTEPS);
        pace.after_robust();
    }
    *next_s = pace.next_s(dt_s);
    state
}

/// When the speed changes its sign by so much that the sub-step has to end there, s from its beginning; 0 where it
/// began in the wrong direction.
#[inline]
fn next_turn<const FULL: bool>(trial: &Trial<FULL>, direction: f64, step_s: f64, change: f64) -> Option<f64> {
    match trial.speeds.course(direction, change) {
        Course::Keeps => None,
        Course::Opposite => (trial.speeds.end.abs() * step_s > TURN_TOLERANCE).then_some(0.0),
        Course::Turns { part, depth } => {
            if depth * (1.0 - part) * step_s <= TURN_TOLERANCE {
                return None;
            }
            let before = direction * trial.speeds.start;
            let at_once = before > 0.0 && before * part * step_s < TURN_TOLERANCE;
            Some(if at_once { 0.0 } else { part * step_s })
        }
    }
}

/// One over the errors accepted.
struct Scales {
    per_angle: f64,
    per_speed: f64,
    per_other_speed: f64,
    per_z: f64,
}

impl Scales {
    fn new<L: Law>(law: &L, coarseness: f64) -> Self {
        let per_speed = 1.0 / SPEED_TOLERANCE;
        Self {
            per_angle: 1.0 / (ANGLE_TOLERANCE * coarseness),
            per_speed: per_speed.max(law.relative_damping_s_per_rad() / DAMPING_TOLERANCE) / coarseness,
            per_other_speed: per_speed / coarseness,
            per_z: law.relative_stiffness_per_rad() / (TORQUE_TOLERANCE * coarseness),
        }
    }

    /// The size of an error, 1 at the tolerances.
    #[inline]
    fn size<const FULL: bool>(&self, error: &ShaftState<FULL>) -> f64 {
        let angle = error.angle * self.per_angle;
        let speed = error.speed * self.per_speed;
        let z = error.z * self.per_z;
        let mut sum = angle * angle + speed * speed + z * z;
        if FULL {
            let rotor_angle = error.rotor_angle * self.per_angle;
            let rotor_speed = error.rotor_speed * self.per_other_speed;
            let curve_speed = error.curve_speed * self.per_other_speed;
            let stage_speed = error.stage_speed * self.per_other_speed;
            sum += rotor_angle * rotor_angle + rotor_speed * rotor_speed;
            sum += curve_speed * curve_speed + stage_speed * stage_speed;
        }
        (sum / 3.0).sqrt()
    }
}

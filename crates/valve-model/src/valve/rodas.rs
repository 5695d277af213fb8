//! The integrator: an L-stable Rosenbrock method of third order with an embedded second-order one (Rodas3, Sandu and
//! others, Atmospheric Environment 31, 1997), its sub-steps chosen by the difference of the two.
//!
//! The cost of a cycle is bounded: after a fixed number of attempts the rest of the cycle is left to a first-order
//! method that is stable for any parameters ([`super::robust`]). Everything is deterministic.

use super::linear::{Jacobian, Solver};
use super::robust;
use super::shaft::{Shaft, ShaftState};
use crate::FrictionState;
use crate::friction::{Law, Memory};

/// Attempts at a sub-step in one cycle.
const ATTEMPTS: usize = 512;
/// Sub-steps of the robust method, for what the attempts left of a cycle.
const ROBUST_SUBSTEPS: usize = 4;
/// No sub-step is shorter than this part of the cycle.
const SHORTEST: f64 = 1e-7;
/// Errors accepted in one sub-step: of the angle in rad, of the speed in rad/s, of the bristle's torque in
/// parts of the Coulomb torque.
const ANGLE_TOLERANCE: f64 = 1e-8;
const SPEED_TOLERANCE: f64 = 1e-5;
const TORQUE_TOLERANCE: f64 = 2e-4;
/// As the last, for what an error of the speed makes of the torque through the law's damping.
const DAMPING_TOLERANCE: f64 = 5e-4;

/// The length of the next sub-step, carried from cycle to cycle.
pub(super) struct Substeps {
    pub next_s: f64,
}

/// Moves `state` through `dt_s`, from the beginning of the shaft's cycle.
pub(super) fn integrate<L: Law, const FULL: bool>(
    shaft: &mut Shaft<'_, L, FULL>,
    mut state: ShaftState<FULL>,
    friction: &mut FrictionState,
    dt_s: f64,
    substeps: &mut Substeps,
) -> ShaftState<FULL> {
    let scales = Scales::new(shaft.law);
    let shortest_s = SHORTEST * dt_s;
    let mut next_s = if substeps.next_s > 0.0 { substeps.next_s } else { 0.05 * dt_s };
    let mut time_s = 0.0;
    for _ in 0..ATTEMPTS {
        let left_s = dt_s - time_s;
        if left_s <= 0.0 {
            break;
        }
        // Two even pieces rather than a long and a short one.
        let last = next_s >= left_s;
        let step_s = if last {
            left_s
        } else if 2.0 * next_s > left_s {
            0.5 * left_s
        } else {
            next_s
        };
        let error = match attempt(shaft, &state, time_s, step_s, &friction.memory, &scales) {
            Some((new_state, error)) if error <= 1.0 => {
                shaft.accept(&state, &new_state, step_s, friction);
                state = new_state;
                time_s = if last { dt_s } else { time_s + step_s };
                error
            }
            Some((_, error)) => error,
            None => 1e3,
        };
        let change = (0.85 / error.max(1e-6).cbrt()).clamp(0.1, 4.0);
        // A last piece cut short by the cycle's end says nothing against a longer one.
        let wanted_s = step_s * change;
        next_s = if error <= 1.0 && step_s < next_s { wanted_s.max(next_s) } else { wanted_s };
        if next_s < shortest_s {
            break;
        }
    }
    if time_s < dt_s {
        state = robust::integrate(shaft, state, friction, (time_s, dt_s), ROBUST_SUBSTEPS);
        next_s = next_s.max(0.01 * dt_s);
    }
    substeps.next_s = next_s.min(dt_s);
    state
}

/// One sub-step: the new state and its error, 1 at the tolerance; `None` where it can't be taken at all.
#[inline]
fn attempt<L: Law, const FULL: bool>(
    shaft: &Shaft<'_, L, FULL>,
    state: &ShaftState<FULL>,
    time_s: f64,
    step_s: f64,
    memory: &Memory,
    scales: &Scales,
) -> Option<(ShaftState<FULL>, f64)> {
    let per_step = 1.0 / step_s;
    let end_s = time_s + step_s;
    let jacobian = Jacobian::new(shaft, state, time_s, memory);
    let (rates, by_time) = (jacobian.rates, jacobian.by_time);
    let solver = Solver::new(jacobian, 2.0 * per_step)?;

    let first = solver.solve(rates.plus(0.5 * step_s, by_time));
    let second = solver.solve(rates.plus(4.0 * per_step, first).plus(1.5 * step_s, by_time));

    let base = state.plus(2.0, first);
    let drift = ShaftState::default().plus(per_step, first).plus(-per_step, second);
    let third = solver.solve(shaft.rates(&base, end_s, memory).plus(1.0, drift));

    let embedded = base.plus(1.0, third);
    let right = shaft.rates(&embedded, end_s, memory).plus(1.0, drift);
    let error = solver.solve(right.plus(-8.0 / 3.0 * per_step, third));

    let new_state = embedded.plus(1.0, error);
    let size = scales.size(&error);
    (new_state.is_finite() && size.is_finite()).then_some((new_state, size))
}

/// One over the errors accepted.
struct Scales {
    per_speed: f64,
    per_z: f64,
}

impl Scales {
    fn new<L: Law>(law: &L) -> Self {
        Self {
            per_speed: (1.0 / SPEED_TOLERANCE).max(law.relative_damping_s_per_rad() / DAMPING_TOLERANCE),
            per_z: law.relative_stiffness_per_rad() / TORQUE_TOLERANCE,
        }
    }

    /// The size of an error, 1 at the tolerances.
    #[inline]
    fn size<const FULL: bool>(&self, error: &ShaftState<FULL>) -> f64 {
        let angle = error.angle / ANGLE_TOLERANCE;
        let speed = error.speed * self.per_speed;
        let z = error.z * self.per_z;
        let mut sum = angle * angle + speed * speed + z * z;
        if FULL {
            let rotor_angle = error.rotor_angle / ANGLE_TOLERANCE;
            let rotor_speed = error.rotor_speed / SPEED_TOLERANCE;
            let curve_speed = error.curve_speed / SPEED_TOLERANCE;
            sum += rotor_angle * rotor_angle + rotor_speed * rotor_speed + curve_speed * curve_speed;
        }
        (sum / 3.0).sqrt()
    }
}

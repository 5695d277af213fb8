//! The method of last resort: the bristle exactly at a frozen speed, and the speed by implicit Euler, solved by
//! bracketing. First order, stable for any parameters and step, with a fixed bound on its cost.
//!
//! R(ω₁) = J·(ω₁ − ω₀)/h − T_motor(θ₀ + h·ω₁) + T_friction(ω₁) + T_other may have several zeros where the friction
//! curve falls. The shaft takes the first one in the direction in which the net torque pushes it: the limit of a fast
//! motion that the step doesn't resolve.

use super::effects::Coupling;
use super::shaft::{Shaft, ShaftState};
use crate::FrictionState;
use crate::friction::{Law, Memory, Point, sign};

/// Doublings of the search outwards from the present speed, and halvings of the bracket found.
const DOUBLINGS: usize = 45;
const HALVINGS: usize = 45;
/// The bracket is narrow enough at this part of the speed, or at this speed in rad/s.
const NARROW: f64 = 1e-10;
/// The first step of the search, rad/s.
const FIRST_SEARCH: f64 = 1e-6;

/// Moves `state` from `times_s.0` to `times_s.1` in `count` sub-steps.
pub(super) fn integrate<L: Law, const FULL: bool>(
    shaft: &mut Shaft<'_, L, FULL>,
    mut state: ShaftState<FULL>,
    friction: &mut FrictionState,
    times_s: (f64, f64),
    count: usize,
) -> ShaftState<FULL> {
    let step_s = (times_s.1 - times_s.0) / count as f64;
    for index in 0..count {
        let end_s = times_s.0 + step_s * (index + 1) as f64;
        let trial = Trial { shaft, start: &state, end_s, step_s, memory: &friction.memory };
        let speed = solve_speed(|speed| trial.residual(speed), state.speed);
        let end = trial.end(speed);
        shaft.accept(&state, &end, step_s, friction);
        state = end;
    }
    state
}

/// One sub-step, to be tried at several speeds.
struct Trial<'a, 'b, L, const FULL: bool> {
    shaft: &'a Shaft<'b, L, FULL>,
    start: &'a ShaftState<FULL>,
    end_s: f64,
    step_s: f64,
    memory: &'a Memory,
}

impl<L: Law, const FULL: bool> Trial<'_, '_, L, FULL> {
    /// The state at the end if the spool's speed is `speed` throughout.
    fn end(&self, speed: f64) -> ShaftState<FULL> {
        let start = self.start;
        let mut end = ShaftState { angle: start.angle + self.step_s * speed, speed, ..*start };
        if FULL {
            let lag = self.shaft.params.effects.lag;
            end.lags(lag.after_ramp((speed, speed), start.lagging(), self.step_s));
            if let Some(coupling) = self.shaft.coupling() {
                end.rotor_speed = self.rotor_speed(&end, coupling);
                end.rotor_angle = start.rotor_angle + self.step_s * end.rotor_speed;
            }
        }
        let levels = self.shaft.levels_at(&end, self.end_s);
        let at = Point { z: start.z, direction: sign(speed), ..self.shaft.point(&end) };
        end.z = self.shaft.law.frozen(at, self.step_s, &levels, self.memory);
        end
    }

    /// The rotor behind its spring, by implicit Euler with the motor's greatest stiffness for its present one.
    fn rotor_speed(&self, spool: &ShaftState<FULL>, coupling: Coupling) -> f64 {
        let (start, params) = (self.start, self.shaft.params);
        let motor_nm = self.shaft.motor_nm(start.rotor_angle, self.end_s);
        let spring_nm = -coupling.torque_nm(start.rotor_angle - spool.angle, -spool.speed);
        let most_stiffness = coupling.stiffness_nm_per_rad + params.holding_torque_nm * params.rotor_teeth;
        let inertia_per_s = 1.0 / (params.per_rotor_inertia * self.step_s);
        (inertia_per_s * start.rotor_speed + motor_nm + spring_nm)
            / (inertia_per_s
                + params.damping_nm_s_per_rad
                + coupling.damping_nm_s_per_rad
                + self.step_s * most_stiffness)
    }

    /// R(ω₁), in rad/s².
    fn residual(&self, speed: f64) -> f64 {
        let (shaft, start, end) = (self.shaft, self.start, self.end(speed));
        let rate = (end.z - start.z) / self.step_s;
        let levels = shaft.levels_at(&end, self.end_s);
        let at = Point { direction: sign(speed), ..shaft.point(&end) };
        let friction_nm = shaft.law.torque(at, rate, &levels, self.memory);
        let load_nm = friction_nm + shaft.other(end.angle).0;
        let acceleration = if let Some(coupling) = shaft.coupling() {
            (end.carried_nm(coupling) - load_nm) * shaft.params.per_load_inertia
        } else {
            let damping_nm = shaft.params.damping_nm_s_per_rad * speed;
            (shaft.motor_nm(end.angle, self.end_s) - damping_nm - load_nm) * shaft.params.per_inertia
        };
        (speed - start.speed) / self.step_s - shaft.pushed(acceleration, &end, self.end_s)
    }
}

/// The first zero of a function that rises in the end, from `start` in the direction in which it falls.
fn solve_speed(residual: impl Fn(f64) -> f64, start: f64) -> f64 {
    let at_start = residual(start);
    if at_start == 0.0 || !at_start.is_finite() {
        return start;
    }
    let direction = -at_start.signum();
    let (mut near, mut far) = (start, start);
    let mut reach = FIRST_SEARCH;
    for _ in 0..DOUBLINGS {
        far = start + direction * reach;
        if residual(far) * at_start <= 0.0 {
            break;
        }
        near = far;
        reach *= 2.0;
    }
    for _ in 0..HALVINGS {
        if (far - near).abs() <= NARROW * (1.0 + far.abs()) {
            break;
        }
        let middle = 0.5 * (near + far);
        if residual(middle) * at_start > 0.0 {
            near = middle;
        } else {
            far = middle;
        }
    }
    far
}

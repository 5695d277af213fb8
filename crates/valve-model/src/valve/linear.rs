//! The linear systems of an implicit step: (s·I − J)·x = r with the Jacobian J of the shaft's equations, eliminated by
//! hand down to the spool's speed.

use super::customs::Customs;
use super::effects::Coupling;
use super::shaft::{MotorTorque, Shaft, ShaftState, lighter};
use crate::friction::{Lag, Law, Levels, Memory, Pivots};
use crate::{ActsOn, Covariate};

/// The rates at one instant and their derivatives.
pub(super) struct Jacobian<const FULL: bool> {
    pub rates: ShaftState<FULL>,
    /// ∂(rates)/∂t, through the command.
    pub by_time: ShaftState<FULL>,
    pub motor: MotorTorque,
    speed_by_angle: f64,
    speed_by_speed: f64,
    speed_by_z: f64,
    z_by_angle: f64,
    z_by_speed: f64,
    z_by_z: f64,
    extra: Extra,
}

/// What `FULL` adds: the lagging speed and the rotor behind its spring.
#[derive(Default, Clone, Copy)]
struct Extra {
    lag: Lag,
    speed_by_curve_speed: f64,
    z_by_curve_speed: f64,
    speed_by_rotor_angle: f64,
    speed_by_rotor_speed: f64,
    rotor_by_angle: f64,
    rotor_by_speed: f64,
    rotor_by_rotor_angle: f64,
    rotor_by_rotor_speed: f64,
}

impl<const FULL: bool> Jacobian<FULL> {
    #[inline]
    pub fn new<L: Law>(
        shaft: &Shaft<'_, L, FULL>,
        state: &ShaftState<FULL>,
        time_s: f64,
        memory: &Memory,
    ) -> Self {
        if let Some(coupling) = shaft.coupling() {
            return Self::compliant(shaft, state, time_s, memory, coupling);
        }
        let (friction, level_per_rad) = shaft.linearised(state, time_s, memory);
        let (other_nm, other_by_angle) = shaft.other(state.angle);
        let motor = shaft.motor(state.angle, time_s);
        let params = shaft.params;
        let per_inertia = params.per_inertia;
        let damping = params.damping_nm_s_per_rad;
        let net_nm = motor.torque_nm - damping * state.speed - friction.flow.torque_nm - other_nm;
        let load_by_angle = friction.torque_by_level * level_per_rad + other_by_angle;
        let mut jacobian = Self {
            rates: ShaftState {
                angle: state.speed,
                speed: net_nm * per_inertia,
                z: friction.flow.rate,
                ..ShaftState::default()
            },
            by_time: ShaftState { speed: motor.by_time * per_inertia, ..ShaftState::default() },
            motor,
            speed_by_angle: (motor.by_angle - load_by_angle) * per_inertia,
            speed_by_speed: -(damping + friction.torque_by_speed) * per_inertia,
            speed_by_z: -friction.torque_by_z * per_inertia,
            z_by_angle: friction.rate_by_level * level_per_rad,
            z_by_speed: friction.rate_by_speed,
            z_by_z: friction.rate_by_z,
            extra: Extra::default(),
        };
        let by_curve_speed = (-friction.torque_by_curve_speed * per_inertia, friction.rate_by_curve_speed);
        jacobian.lag(state, params.effects.lag, by_curve_speed);
        if let Some(customs) = shaft.customs() {
            jacobian.rates = shaft.rates(state, time_s, &motor, memory);
            jacobian.add(customs, shaft, state, time_s, memory);
        }
        jacobian
    }

    #[cold]
    fn compliant<L: Law>(
        shaft: &Shaft<'_, L, FULL>,
        state: &ShaftState<FULL>,
        time_s: f64,
        memory: &Memory,
        coupling: Coupling,
    ) -> Self {
        let Coupling { stiffness_nm_per_rad: stiffness, damping_nm_s_per_rad: damping } = coupling;
        let (friction, level_per_rad) = shaft.linearised(state, time_s, memory);
        let (_, other_by_angle) = shaft.other(state.angle);
        let motor = shaft.motor(state.rotor_angle, time_s);
        let params = shaft.params;
        let (per_load, per_rotor) = (params.per_load_inertia, params.per_rotor_inertia);
        let load_by_angle = friction.torque_by_level * level_per_rad + other_by_angle;
        let mut jacobian = Self {
            rates: shaft.rates(state, time_s, &motor, memory),
            motor,
            by_time: ShaftState { rotor_speed: motor.by_time * per_rotor, ..ShaftState::default() },
            speed_by_angle: -(stiffness + load_by_angle) * per_load,
            speed_by_speed: -(damping + friction.torque_by_speed) * per_load,
            speed_by_z: -friction.torque_by_z * per_load,
            z_by_angle: friction.rate_by_level * level_per_rad,
            z_by_speed: friction.rate_by_speed,
            z_by_z: friction.rate_by_z,
            extra: Extra {
                speed_by_rotor_angle: stiffness * per_load,
                speed_by_rotor_speed: damping * per_load,
                rotor_by_angle: stiffness * per_rotor,
                rotor_by_speed: damping * per_rotor,
                rotor_by_rotor_angle: (motor.by_angle - stiffness) * per_rotor,
                rotor_by_rotor_speed: -(damping + params.damping_nm_s_per_rad) * per_rotor,
                ..Extra::default()
            },
        };
        let by_curve_speed = (-friction.torque_by_curve_speed * per_load, friction.rate_by_curve_speed);
        jacobian.lag(state, params.effects.lag, by_curve_speed);
        if let Some(customs) = shaft.customs() {
            jacobian.add(customs, shaft, state, time_s, memory);
        }
        jacobian
    }

    /// What users' formulas and tables add to the derivatives; the rates have their values already.
    #[cold]
    fn add<L: Law>(
        &mut self,
        customs: &Customs,
        shaft: &Shaft<'_, L, FULL>,
        state: &ShaftState<FULL>,
        time_s: f64,
        memory: &Memory,
    ) {
        let at = shaft.moment(state, self.rates.speed, time_s);
        let torque = customs.torque_sloped(&at);
        let per_inertia = shaft.per_moved_inertia();
        let mut load_by = torque.slopes;
        if customs.scales() {
            let (load, rate) = scaled_slopes(customs, shaft, state, time_s, memory);
            load_by.iter_mut().zip(load).for_each(|(sum, more)| *sum += more);
            let [by_angle, by_speed, _, by_time] = rate;
            self.z_by_angle += by_angle;
            self.z_by_speed += by_speed;
            self.by_time.z += by_time;
        }
        let [by_angle, by_speed, _, by_load_time] = load_by;
        self.speed_by_angle -= by_angle * per_inertia;
        self.speed_by_speed -= by_speed * per_inertia;
        self.by_time.speed -= by_load_time * per_inertia;
        let lighter = lighter(per_inertia, &torque.slopes);
        for slope in [
            &mut self.speed_by_angle,
            &mut self.speed_by_speed,
            &mut self.speed_by_z,
            &mut self.by_time.speed,
            &mut self.extra.speed_by_curve_speed,
            &mut self.extra.speed_by_rotor_angle,
            &mut self.extra.speed_by_rotor_speed,
        ] {
            *slope *= lighter;
        }
    }

    /// The curve is read at the speed itself, or at a speed that lags.
    #[inline]
    fn lag(&mut self, state: &ShaftState<FULL>, lag: Lag, (speed, z): (f64, f64)) {
        if FULL && lag.is_there() {
            self.rates.lags(lag.rates(state.speed, state.lagging()));
            self.extra.lag = lag;
            self.extra.speed_by_curve_speed = speed;
            self.extra.z_by_curve_speed = z;
        } else {
            self.speed_by_speed += speed;
            self.z_by_speed += z;
        }
    }
}

/// The derivatives of friction's torque (N·m) and of dz/dt (rad/s) through the factors that users give its levels and σ2.
fn scaled_slopes<L: Law, const FULL: bool>(
    customs: &Customs,
    shaft: &Shaft<'_, L, FULL>,
    state: &ShaftState<FULL>,
    time_s: f64,
    memory: &Memory,
) -> ([f64; Covariate::MOVING], [f64; Covariate::MOVING]) {
    let levels = shaft.levels_at(state, time_s);
    let (friction, _) = shaft.linearised(state, time_s, memory);
    // The torque is linear in σ2.
    let more = Levels { viscous: levels.viscous + 1.0, ..levels };
    let by_viscous = shaft.law.flow(shaft.point(state), &more, memory).torque_nm - friction.flow.torque_nm;
    let at = shaft.moment(state, 0.0, time_s);
    let level = customs.steepness(ActsOn::Level, &at).map(|steep| steep * levels.level);
    let viscous = customs.steepness(ActsOn::Viscous, &at).map(|steep| steep * levels.viscous);
    let mut load = level.map(|slope| friction.torque_by_level * slope);
    load.iter_mut().zip(viscous).for_each(|(sum, slope)| *sum += by_viscous * slope);
    (load, level.map(|slope| friction.rate_by_level * slope))
}

/// s·I − J, factored.
pub(super) struct Solver<const FULL: bool> {
    per_shift: f64,
    per_z_pivot: f64,
    per_pivot: f64,
    speed_by_angle: f64,
    speed_by_z: f64,
    z_by_angle: f64,
    z_by_speed: f64,
    extra: Extra,
    lag: Pivots,
    per_rotor_pivot: f64,
    speed_by_rotor: f64,
}

impl<const FULL: bool> Solver<FULL> {
    /// `None` where the matrix isn't positive: the step is then too long for an unstable stretch of the curve.
    #[inline]
    pub fn new(jacobian: &Jacobian<FULL>, shift: f64) -> Option<Self> {
        let per_shift = 1.0 / shift;
        let per_z_pivot = 1.0 / (shift - jacobian.z_by_z);
        let extra = jacobian.extra;
        let (mut speed_by_angle, mut speed_by_speed) = (jacobian.speed_by_angle, jacobian.speed_by_speed);
        let mut z_by_speed = jacobian.z_by_speed;
        let lag = extra.lag.pivots(shift);
        let (mut per_rotor_pivot, mut speed_by_rotor) = (0.0, 0.0);
        if FULL {
            let curve_by_speed = lag.by_speed().curve;
            speed_by_speed += extra.speed_by_curve_speed * curve_by_speed;
            z_by_speed += extra.z_by_curve_speed * curve_by_speed;
            let rotor_pivot = shift - extra.rotor_by_rotor_speed - extra.rotor_by_rotor_angle * per_shift;
            per_rotor_pivot = 1.0 / rotor_pivot;
            // The spool's speed by the rotor's, which turns the rotor on too.
            speed_by_rotor = extra.speed_by_rotor_speed + extra.speed_by_rotor_angle * per_shift;
            speed_by_angle += speed_by_rotor * extra.rotor_by_angle * per_rotor_pivot;
            speed_by_speed += speed_by_rotor * extra.rotor_by_speed * per_rotor_pivot;
        }
        let pivot = shift
            - speed_by_speed
            - speed_by_angle * per_shift
            - jacobian.speed_by_z * (z_by_speed + jacobian.z_by_angle * per_shift) * per_z_pivot;
        let sound = pivot > 0.0 && per_z_pivot > 0.0 && (!FULL || per_rotor_pivot > 0.0);
        sound.then_some(Self {
            per_shift,
            per_z_pivot,
            per_pivot: 1.0 / pivot,
            speed_by_angle,
            speed_by_z: jacobian.speed_by_z,
            z_by_angle: jacobian.z_by_angle,
            z_by_speed,
            extra,
            lag,
            per_rotor_pivot,
            speed_by_rotor,
        })
    }

    /// Solves (s·I − J)·x = right.
    #[inline]
    pub fn solve(&self, right: ShaftState<FULL>) -> ShaftState<FULL> {
        if !FULL {
            return self.solve_spool(right);
        }
        let extra = &self.extra;
        // What curve speed and rotor would be if the spool stood still; their dependence on it is in the pivots.
        let lagging = self.lag.standing(right.lagging());
        let rotor_right = right.rotor_speed + extra.rotor_by_rotor_angle * right.rotor_angle * self.per_shift;
        let rotor_speed = rotor_right * self.per_rotor_pivot;
        let mut spool = right;
        spool.speed += extra.speed_by_curve_speed * lagging.curve
            + extra.speed_by_rotor_angle * right.rotor_angle * self.per_shift
            + self.speed_by_rotor * rotor_speed;
        spool.z += extra.z_by_curve_speed * lagging.curve;
        let mut solved = self.solve_spool(spool);
        let by_speed = self.lag.by_speed();
        solved.stage_speed = lagging.stage + by_speed.stage * solved.speed;
        solved.curve_speed = lagging.curve + by_speed.curve * solved.speed;
        let of_spool = extra.rotor_by_angle * solved.angle + extra.rotor_by_speed * solved.speed;
        solved.rotor_speed = rotor_speed + of_spool * self.per_rotor_pivot;
        solved.rotor_angle = (right.rotor_angle + solved.rotor_speed) * self.per_shift;
        solved
    }

    #[inline]
    fn solve_spool(&self, right: ShaftState<FULL>) -> ShaftState<FULL> {
        let right_z = right.z + self.z_by_angle * right.angle * self.per_shift;
        let from_angle = self.speed_by_angle * right.angle * self.per_shift;
        let from_z = self.speed_by_z * right_z * self.per_z_pivot;
        let speed = (right.speed + from_angle + from_z) * self.per_pivot;
        let angle = (right.angle + speed) * self.per_shift;
        let z = (right.z + self.z_by_angle * angle + self.z_by_speed * speed) * self.per_z_pivot;
        ShaftState { angle, speed, z, ..ShaftState::default() }
    }
}

//! The equations of motion: J·dω/dt = T_hold·sin(N_r·(θ_cmd − θ)) − D·ω − T_friction(ω, z) − T_other, dθ/dt = ω, and
//! the friction law's dz/dt.
//!
//! With `FULL` there is more: friction that depends on the angle or lags behind the speed, detent torque, micro-step
//! error, other torques, and a spring between rotor and spool. Without, none of it costs anything.

use super::customs::{Customs, Held, Moment};
use super::effects::{Coupling, Moving, OtherTorque};
use super::input::ValveInput;
use super::params::ValveParams;
use crate::friction::{Contact, Lagging, Law, Levels, Linearised, Memory, Point, sign};
use crate::{Covariate, FrictionState};

/// Angles in rad, speeds in rad/s, z in rad; also their increments and rates. Beyond z with `FULL` alone.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ShaftState<const FULL: bool> {
    /// The spool's, and the rotor's where no spring lies between them.
    pub angle: f64,
    pub speed: f64,
    pub z: f64,
    /// The speed at which the steady curve is read, and the one between two stages of its lag.
    pub curve_speed: f64,
    pub stage_speed: f64,
    pub rotor_angle: f64,
    pub rotor_speed: f64,
}

impl<const FULL: bool> ShaftState<FULL> {
    /// self + factor·other
    #[inline]
    pub fn plus(mut self, factor: f64, other: Self) -> Self {
        self.angle += factor * other.angle;
        self.speed += factor * other.speed;
        self.z += factor * other.z;
        if FULL {
            self.curve_speed += factor * other.curve_speed;
            self.stage_speed += factor * other.stage_speed;
            self.rotor_angle += factor * other.rotor_angle;
            self.rotor_speed += factor * other.rotor_speed;
        }
        self
    }

    /// self + Σ weights·others
    #[inline]
    pub fn plus_all<const N: usize>(mut self, weights: &[f64; N], others: [&Self; N]) -> Self {
        for (weight, other) in weights.iter().zip(&others) {
            self = self.plus(*weight, **other);
        }
        self
    }

    /// What lags.
    #[inline]
    pub fn lagging(&self) -> Lagging {
        Lagging { stage: self.stage_speed, curve: self.curve_speed }
    }

    /// Takes what lags.
    #[inline]
    pub fn lags(&mut self, lagging: Lagging) {
        (self.stage_speed, self.curve_speed) = (lagging.stage, lagging.curve);
    }

    /// What the spring between rotor and spool carries, N·m.
    #[inline]
    pub fn carried_nm(&self, coupling: Coupling) -> f64 {
        coupling.torque_nm(self.rotor_angle - self.angle, self.rotor_speed - self.speed)
    }

    pub fn is_finite(&self) -> bool {
        let rigid = self.angle.is_finite() && self.speed.is_finite() && self.z.is_finite();
        let lags = self.curve_speed.is_finite() && self.stage_speed.is_finite();
        let rest = lags && self.rotor_angle.is_finite() && self.rotor_speed.is_finite();
        rigid && (!FULL || rest)
    }
}

/// The torques at one instant, N·m.
pub(super) struct Torques {
    pub motor_nm: f64,
    pub friction_nm: f64,
    pub other_nm: f64,
    /// What the transducer between motor and load reads.
    pub load_nm: f64,
}

/// The shaft during one cycle.
pub(super) struct Shaft<'a, L, const FULL: bool> {
    pub law: &'a L,
    /// What scales friction, the angle's part left out.
    pub levels: Levels,
    pub params: &'a ValveParams,
    /// ±1: the sign with which friction takes |ω| and sgn ω.
    pub direction: f64,
    /// The elements before the last sub-step.
    before: Option<Memory>,
    holding_nm: f64,
    command_rad: f64,
    command_rad_per_s: f64,
    held: Held,
    other: OtherTorque<'a>,
}

/// The motor's torque and what it depends on.
#[derive(Clone, Copy)]
pub(super) struct MotorTorque {
    pub torque_nm: f64,
    /// ∂T/∂θ of the rotor, N·m/rad.
    pub by_angle: f64,
    /// ∂T/∂t through the command, N·m/s.
    pub by_time: f64,
    /// T_hold·cos where the torque is T_hold·sin, N·m.
    quadrature_nm: f64,
    rotor_angle: f64,
    time_s: f64,
}

impl<'a, L: Law, const FULL: bool> Shaft<'a, L, FULL> {
    pub fn new(
        params: &'a ValveParams,
        law: &'a L,
        input: &ValveInput,
        dt_s: f64,
        friction: &FrictionState,
    ) -> Self {
        let command_rad_per_s = (input.command_end_rad - input.command_start_rad) / dt_s;
        let effects = &params.effects;
        let other =
            if params.loaded { effects.other_torque(input.pressure_drop_pa) } else { OtherTorque::default() };
        Self {
            law,
            levels: effects.levels(input.pressure_drop_pa, input.oil_temperature_c, &friction.contact),
            params,
            direction: 1.0,
            before: None,
            holding_nm: input.current_ratio * params.available_torque_nm(command_rad_per_s),
            command_rad: input.command_start_rad,
            command_rad_per_s,
            held: Held::new(input.pressure_drop_pa, input.oil_temperature_c, &friction.contact),
            other,
        }
    }

    /// The command `time_s` into the cycle as the windings have it, rad, and its rate.
    #[inline]
    fn command(&self, time_s: f64) -> (f64, f64) {
        let command = self.command_rad + self.command_rad_per_s * time_s;
        match &self.params.effects.microstep {
            Some(series) if FULL => {
                let teeth = self.params.rotor_teeth;
                let (error, slope) = series.at(teeth * command);
                (command + error, self.command_rad_per_s * (1.0 + teeth * slope))
            }
            _ => (command, self.command_rad_per_s),
        }
    }

    /// The motor's torque without its damping.
    #[inline]
    pub fn motor(&self, rotor_angle: f64, time_s: f64) -> MotorTorque {
        let (command, command_rate) = self.command(time_s);
        let (sin, cos) = (self.params.rotor_teeth * (command - rotor_angle)).sin_cos();
        let stiffness = self.holding_nm * self.params.rotor_teeth * cos;
        let mut motor = MotorTorque {
            torque_nm: self.holding_nm * sin,
            by_angle: -stiffness,
            by_time: stiffness * command_rate,
            quadrature_nm: self.holding_nm * cos,
            rotor_angle,
            time_s,
        };
        if FULL && let Some(series) = &self.params.effects.detent {
            let (torque_nm, slope) = series.at(self.params.full_steps_per_rev * rotor_angle);
            motor.torque_nm += torque_nm;
            motor.by_angle += self.params.full_steps_per_rev * slope;
        }
        motor
    }

    /// The motor's torque without its damping, alone: cheaper than [`Self::motor`].
    #[inline]
    pub fn motor_nm(&self, rotor_angle: f64, time_s: f64) -> f64 {
        if FULL {
            return self.motor(rotor_angle, time_s).torque_nm;
        }
        let command = self.command_rad + self.command_rad_per_s * time_s;
        self.holding_nm * (self.params.rotor_teeth * (command - rotor_angle)).sin()
    }

    /// As [`Self::motor_nm`], at an instant near that of `from`: by the sums of angles, whose series cost a third of a
    /// sine and are exact to 3e-15 as far as they are used.
    #[inline(always)]
    fn motor_near_nm(&self, from: &MotorTorque, rotor_angle: f64, time_s: f64) -> f64 {
        const NEAR_RAD: f64 = 0.1;
        let ahead_rad = self.command_rad_per_s * (time_s - from.time_s) - (rotor_angle - from.rotor_angle);
        let turn = self.params.rotor_teeth * ahead_rad;
        let waves = FULL && (self.params.effects.microstep.is_some() || self.params.effects.detent.is_some());
        if waves || turn.abs() > NEAR_RAD {
            return self.motor_nm(rotor_angle, time_s);
        }
        let square = turn * turn;
        let series = |first: f64, second: f64, third: f64| {
            1.0 - square * first * (1.0 - square * second * (1.0 - square * third))
        };
        let sin = turn * series(1.0 / 6.0, 1.0 / 20.0, 1.0 / 42.0);
        let cos = 1.0 - 0.5 * square * series(1.0 / 12.0, 1.0 / 30.0, 1.0 / 56.0);
        from.torque_nm * cos + from.quadrature_nm * sin
    }

    /// The spring between rotor and spool, where there is one.
    #[inline]
    pub fn coupling(&self) -> Option<Coupling> {
        let coupling = self.params.effects.coupling;
        (FULL && coupling.is_there()).then_some(coupling)
    }

    /// Other torques: N·m against the motor, and their derivative by the angle; a constant one without `FULL`.
    #[inline]
    pub fn other(&self, angle: f64) -> (f64, f64) {
        self.other.at::<FULL>(angle)
    }

    #[inline]
    pub fn levels_at(&self, state: &ShaftState<FULL>, time_s: f64) -> Levels {
        if !FULL {
            return self.levels;
        }
        let moving = Moving { angle: state.angle, speed: state.speed, acceleration: 0.0 };
        self.params.effects.levels_at(&self.levels, &self.held, moving, time_s)
    }

    /// The formulas and tables of users, where there are any.
    #[inline]
    pub fn customs(&self) -> Option<&'a Customs> {
        let customs = &self.params.effects.customs;
        (FULL && customs.is_there()).then_some(customs)
    }

    /// What those are asked at.
    pub fn moment(&self, state: &ShaftState<FULL>, acceleration: f64, time_s: f64) -> Moment {
        self.held.at(state.angle, state.speed, acceleration, time_s)
    }

    /// One over the inertia that moves with the spool, 1/(kg·m²).
    pub fn per_moved_inertia(&self) -> f64 {
        if self.coupling().is_some() { self.params.per_load_inertia } else { self.params.per_inertia }
    }

    /// The spool's acceleration with the torques of users, by the one without, rad/s².
    ///
    /// A torque may depend on the acceleration, as one of inertia does. Newton's method then solves a = a₀ − T(a)/J, in a fixed
    /// number of iterations; the first is exact for a linear torque.
    #[inline]
    pub fn pushed(&self, free: f64, state: &ShaftState<FULL>, time_s: f64) -> f64 {
        const ITERATIONS: usize = 4;
        let Some(customs) = self.customs().filter(|customs| customs.loads()) else { return free };
        let per_inertia = self.per_moved_inertia();
        if !customs.is_accelerated() {
            return free - per_inertia * customs.torque_nm(&self.moment(state, 0.0, time_s));
        }
        let mut acceleration = free;
        for _ in 0..ITERATIONS {
            let torque = customs.torque_sloped(&self.moment(state, acceleration, time_s));
            let residual = acceleration - free + per_inertia * torque.value;
            let before = acceleration;
            acceleration -= residual * lighter(per_inertia, &torque.slopes);
            // Any further iteration would find the same.
            if acceleration == before {
                break;
            }
        }
        acceleration
    }

    /// Where the friction law is asked.
    #[inline]
    pub fn point(&self, state: &ShaftState<FULL>) -> Point {
        let lags = FULL && self.params.effects.lag.is_there();
        let curve_speed = if lags { state.curve_speed } else { state.speed };
        Point { speed: state.speed, curve_speed, z: state.z, direction: self.direction }
    }

    #[inline]
    pub fn linearised(&self, state: &ShaftState<FULL>, time_s: f64, memory: &Memory) -> (Linearised, f64) {
        let levels = self.levels_at(state, time_s);
        (self.law.linearise(self.point(state), &levels, memory), levels.level_per_rad)
    }

    /// The rates at an instant near that of `motor`.
    #[inline(always)]
    pub fn rates(
        &self,
        state: &ShaftState<FULL>,
        time_s: f64,
        motor: &MotorTorque,
        memory: &Memory,
    ) -> ShaftState<FULL> {
        let levels = self.levels_at(state, time_s);
        let friction = self.law.flow(self.point(state), &levels, memory);
        let load_nm = friction.torque_nm + self.other(state.angle).0;
        let damping = self.params.damping_nm_s_per_rad;
        let mut rates = ShaftState { angle: state.speed, z: friction.rate, ..ShaftState::default() };
        if let Some(coupling) = self.coupling() {
            let spring_nm = state.carried_nm(coupling);
            let motor_nm = self.motor_near_nm(motor, state.rotor_angle, time_s) - damping * state.rotor_speed;
            rates.speed = (spring_nm - load_nm) * self.params.per_load_inertia;
            rates.rotor_angle = state.rotor_speed;
            rates.rotor_speed = (motor_nm - spring_nm) * self.params.per_rotor_inertia;
        } else {
            let motor_nm = self.motor_near_nm(motor, state.angle, time_s) - damping * state.speed;
            rates.speed = (motor_nm - load_nm) * self.params.per_inertia;
        }
        if FULL {
            rates.speed = self.pushed(rates.speed, state, time_s);
            rates.lags(self.params.effects.lag.rates(state.speed, state.lagging()));
        }
        rates
    }

    pub fn torques(&self, state: &ShaftState<FULL>, time_s: f64, memory: &Memory) -> Torques {
        let levels = self.levels_at(state, time_s);
        let at = Point { direction: sign(state.speed), ..self.point(state) };
        let friction_nm = self.law.flow(at, &levels, memory).torque_nm;
        let mut other_nm = self.other(state.angle).0;
        let damping = self.params.damping_nm_s_per_rad;
        if let Some(coupling) = self.coupling() {
            let motor_nm = self.motor_nm(state.rotor_angle, time_s) - damping * state.rotor_speed;
            let load_nm = state.carried_nm(coupling);
            other_nm += self.pushing_nm(load_nm - friction_nm - other_nm, state, time_s);
            return Torques { motor_nm, friction_nm, other_nm, load_nm };
        }
        let motor_nm = self.motor_nm(state.angle, time_s) - damping * state.speed;
        other_nm += self.pushing_nm(motor_nm - friction_nm - other_nm, state, time_s);
        let acceleration = (motor_nm - friction_nm - other_nm) * self.params.per_inertia;
        let load_nm = self.params.load_inertia_kg_m2 * acceleration + friction_nm + other_nm;
        Torques { motor_nm, friction_nm, other_nm, load_nm }
    }

    /// The torque of users against the motor, N·m, by the net one without it.
    fn pushing_nm(&self, net_nm: f64, state: &ShaftState<FULL>, time_s: f64) -> f64 {
        let Some(customs) = self.customs() else { return 0.0 };
        let acceleration = self.pushed(net_nm * self.per_moved_inertia(), state, time_s);
        customs.torque_nm(&self.moment(state, acceleration, time_s))
    }

    /// What depends on the contact's past is held during a sub-step, as it will be in its middle if `state` goes on as
    /// it does. Elements that slip go on at the slip torque of then: with that of before they would stick for a moment
    /// wherever it grows, and at each such corner the error's estimate would have sub-steps a thousand times as short.
    /// Returns whether anything does.
    #[inline]
    pub fn foresee(
        &mut self,
        state: &ShaftState<FULL>,
        (time_s, step_s): (f64, f64),
        friction: &mut FrictionState,
    ) -> bool {
        let follows = FULL && self.params.effects.follows_the_contact();
        if follows {
            let flow = self.law.flow(self.point(state), &self.levels_at(state, time_s), &friction.memory);
            let half_s = 0.5 * step_s;
            let (turn_rad, slip_rad) = (half_s * state.speed, half_s * (state.speed - flow.rate));
            let mut contact = friction.contact;
            contact.travel(turn_rad, slip_rad, self.params.slip_length_rad, half_s);
            self.hold(&contact);
            if let Some(before) = self.before {
                friction.memory = before;
                self.law.remember(self.point(state), &self.levels, &mut friction.memory);
            }
        }
        follows
    }

    /// Takes a contact's past for what is held.
    fn hold(&mut self, contact: &Contact) {
        let Held { pressure_drop_pa, oil_temperature_c, .. } = self.held;
        self.held = Held::new(pressure_drop_pa, oil_temperature_c, contact);
        self.levels = self.params.effects.levels(pressure_drop_pa, oil_temperature_c, contact);
    }

    /// Takes the contact along from `before` to `after`.
    #[inline]
    pub fn accept(
        &mut self,
        before: &ShaftState<FULL>,
        after: &ShaftState<FULL>,
        dt_s: f64,
        friction: &mut FrictionState,
    ) {
        let follows = FULL && self.params.effects.follows_the_contact();
        if follows {
            self.before = Some(friction.memory);
        }
        self.law.remember(self.point(after), &self.levels, &mut friction.memory);
        if follows {
            let turn_rad = after.angle - before.angle;
            let slip_rad = turn_rad - (after.z - before.z);
            friction.contact.travel(turn_rad, slip_rad, self.params.slip_length_rad, dt_s);
            self.hold(&friction.contact);
        }
    }
}

/// 1/(1 + T'(a)/J), by the derivatives of a torque: what inertia there is, beside what the torque adds to it. It is bounded, since a
/// torque may take inertia away, too.
pub(super) fn lighter(per_inertia: f64, slopes: &[f64; Covariate::MOVING]) -> f64 {
    const LEAST: f64 = 0.1;
    let by_acceleration = slopes.get(Covariate::Acceleration.place()).copied().unwrap_or(0.0);
    1.0 / (1.0 + per_inertia * by_acceleration).max(LEAST)
}

//! The torque that a given motion takes: what a transducer between motor and load reads, J_load·dω/dt + friction + other
//! torques, from a measured angle. No motor is needed.
//!
//! Behind a compliant coupling the angle given is the encoder's, on the motor's side, and the spool's own motion is
//! integrated. There the angle goes smoothly from sample to sample (cubic, by the speeds at its ends): one with a corner at
//! every sample would make the spring ring.

use serde::{Deserialize, Serialize};

use super::customs::Held;
use super::effects::{Effects, Moving};
use super::input::ValveInput;
use super::measurement::{Measurement, SensorDelay};
use super::params::ValveParams;
use super::step::{ValveState, step};
use crate::friction::{Contact, FrictionLaw, Levels, Sweep};
use crate::{ContactPast, FrictionState, Model, ParamError};

/// What [`motion_step`] needs of a model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionParams {
    friction: FrictionLaw,
    effects: Effects,
    slip_length_rad: f64,
    load_inertia_kg_m2: f64,
    measurement: Measurement,
    spring: Option<ValveParams>,
}

/// The contact during a motion: plain data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MotionState {
    /// The contact, as it was at the end of the last step.
    pub friction: FrictionState,
    spool: ValveState,
}

/// A motion at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MotionSample {
    /// Angle, rad.
    pub angle_rad: f64,
    /// Speed, rad/s.
    pub speed_rad_per_s: f64,
    /// Acceleration, rad/s².
    pub acceleration_rad_per_s2: f64,
}

/// A motion between two instants; the speed goes linearly from one to the other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MotionInput {
    /// At the beginning.
    pub start: MotionSample,
    /// At the end.
    pub end: MotionSample,
    /// Pressure drop over the orifice, Pa.
    pub pressure_drop_pa: f64,
    /// Oil temperature, °C.
    pub oil_temperature_c: f64,
}

/// The torques at the end of a motion, N·m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MotionOutput {
    /// Friction, positive against positive speed.
    pub friction_torque_nm: f64,
    /// Other torques, as [`ValveOutput`](crate::ValveOutput) has them.
    pub other_torque_nm: f64,
    /// Between motor and load.
    pub load_torque_nm: f64,
    /// What the transducer reads, its gain and offset included, its delay left out.
    pub measured_torque_nm: f64,
}

/// A load on a coupling counts as rigid if it would swing faster than this, 32 kHz. At 500 Hz, where transducers end, such a coupling
/// changes the torque by the square of 1/64; a simulation of it would take thousands of sub-steps a sample.
const RIGID_RAD_PER_S: f64 = 2e5;

impl MotionParams {
    /// Prepares a model; without `[load]` its inertia counts as zero.
    ///
    /// # Errors
    /// A parameter that is refused; a compliant coupling without a load behind it.
    pub fn new(model: &Model) -> Result<Self, ParamError> {
        model.validate()?;
        let model = model.folded()?;
        let effects = Effects::new(&model);
        let load_inertia_kg_m2 = model.load.map_or(0.0, |load| load.inertia_kg_m2);
        let coupling = effects.coupling;
        let natural_rad_per_s = (coupling.stiffness_nm_per_rad / load_inertia_kg_m2).sqrt();
        let is_rigid = load_inertia_kg_m2 > 0.0 && natural_rad_per_s > RIGID_RAD_PER_S;
        let spring = (coupling.is_there() && !is_rigid)
            .then(|| ValveParams::on_a_spring(&model, load_inertia_kg_m2, coupling))
            .transpose()?;
        let friction = FrictionLaw::new(&model.friction);
        Ok(Self {
            slip_length_rad: friction.slip_length_rad(),
            friction,
            effects,
            load_inertia_kg_m2,
            measurement: Measurement::new(&model, 0.0),
            spring,
        })
    }

    /// How late the torque is against the angle (effect `sensor-delay`).
    pub fn sensor_delay(&self) -> SensorDelay {
        self.measurement.delay
    }

    /// What a torque's reading is times (effect `torque-gain`).
    pub fn torque_gain(&self) -> f64 {
        self.measurement.torque_gain
    }

    /// Whether a spring lies between encoder and spool: its torque asks for speeds more exact than friction's.
    pub fn is_behind_a_spring(&self) -> bool {
        self.spring.is_some()
    }

    /// The pieces that a step of `dt_s` is cut into where a spring lies between encoder and spool: what it costs.
    pub fn pieces_behind_spring(&self, dt_s: f64) -> Option<u32> {
        self.spring.as_ref()?;
        let natural = (self.effects.coupling.stiffness_nm_per_rad / self.load_inertia_kg_m2).sqrt();
        Some((natural * dt_s / PHASE).ceil().clamp(1.0, MOST_PIECES) as u32)
    }

    /// The friction law with the effects that change its numbers.
    pub fn friction_law(&self) -> &FrictionLaw {
        &self.friction
    }

    /// The most that friction carries at rest, N·m, at a pressure drop (Pa) and an oil temperature (°C): the static torque with
    /// the effects that change the levels there, for a contact without a past.
    pub fn static_torque_at(&self, pressure_drop_pa: f64, oil_temperature_c: f64) -> f64 {
        let levels = self.effects.levels(pressure_drop_pa, oil_temperature_c, &Contact::default());
        let held = Held::new(pressure_drop_pa, oil_temperature_c, &Contact::default());
        let levels = self.effects.customs.scaled(levels, &held.at(0.0, 0.0, 0.0, 0.0));
        let asymmetric = 1.0 + levels.asymmetry.abs();
        levels.level * levels.static_factor * asymmetric * self.friction.steady_torque(f64::MIN_POSITIVE)
    }

    /// A contact that begins `motion` with its bristles relaxed.
    pub fn at_start(&self, motion: &MotionSample) -> MotionState {
        self.at_start_after(motion, &ContactPast::default())
    }

    /// A contact with a past that begins `motion`. Behind a compliant coupling the spool begins where the spring
    /// carries what the bristles do.
    pub fn at_start_after(&self, motion: &MotionSample, past: &ContactPast) -> MotionState {
        let friction = FrictionState::after(&self.friction, past, motion.speed_rad_per_s);
        let mut spool = ValveState::at_rest(motion.angle_rad);
        if self.spring.is_some() {
            let carried_nm = friction.torque(&self.friction, 0.0, 0.0, &Levels::NOMINAL);
            spool.angle_rad -= carried_nm / self.effects.coupling.stiffness_nm_per_rad;
        }
        spool.speed_rad_per_s = motion.speed_rad_per_s;
        spool.friction = friction;
        MotionState { friction, spool }
    }
}

/// Moves a contact through `dt_s` of a given motion.
///
/// The cost is bounded whatever the parameters and the motion.
pub fn motion_step(
    params: &MotionParams,
    state: &mut MotionState,
    input: &MotionInput,
    dt_s: f64,
) -> MotionOutput {
    if let Some(spring) = &params.spring {
        return step_behind_spring(params, spring, state, input, dt_s);
    }
    let contact = state.friction.contact;
    let (start, end) = (&input.start, &input.end);
    let levels = params.effects.levels(input.pressure_drop_pa, input.oil_temperature_c, &contact);
    let held = Held::new(input.pressure_drop_pa, input.oil_temperature_c, &contact);
    let middle = Moving {
        angle: 0.5 * (start.angle_rad + end.angle_rad),
        speed: 0.5 * (start.speed_rad_per_s + end.speed_rad_per_s),
        acceleration: 0.5 * (start.acceleration_rad_per_s2 + end.acceleration_rad_per_s2),
    };
    let middle_levels = params.effects.levels_at(&levels, &held, middle, 0.5 * dt_s);
    let before_z = state.friction.z;
    let speeds = (start.speed_rad_per_s, end.speed_rad_per_s);
    let lag = params.effects.lag;
    let lagged = lag.after_ramp(speeds, contact.lagging(), dt_s);
    let curve_start = if lag.is_there() { contact.curve_speed } else { speeds.0 };
    let sweep = Sweep { start: speeds.0, end: speeds.1, curve_start, curve_end: lagged.curve, dt_s };
    state.friction.sweep(&params.friction, sweep, &middle_levels);
    state.friction.contact.curve_speed = lagged.curve;
    state.friction.contact.stage_speed = lagged.stage;
    let turn_rad = 0.5 * (start.speed_rad_per_s + end.speed_rad_per_s) * dt_s;
    let slip_rad = turn_rad - (state.friction.z - before_z);
    state.friction.contact.travel(turn_rad, slip_rad, params.slip_length_rad, dt_s);
    state.friction.contact.clock_s += dt_s;
    params.output(state, input, &levels, &held, dt_s)
}

impl MotionState {
    /// Sets the clock (s) at the beginning of the next step, for who counts time in cycles.
    pub fn set_clock(&mut self, clock_s: f64) {
        self.friction.contact.clock_s = clock_s;
        self.spool.friction.contact.clock_s = clock_s;
    }
}

impl MotionParams {
    fn output(
        &self,
        state: &MotionState,
        input: &MotionInput,
        levels: &Levels,
        held: &Held,
        dt_s: f64,
    ) -> MotionOutput {
        let end = &input.end;
        let moving = Moving {
            angle: end.angle_rad,
            speed: end.speed_rad_per_s,
            acceleration: end.acceleration_rad_per_s2,
        };
        let levels = self.effects.levels_at(levels, held, moving, dt_s);
        let curve_speed = state.friction.contact.curve_speed;
        let friction_nm = state.friction.torque(&self.friction, end.speed_rad_per_s, curve_speed, &levels);
        let (mut other_nm, _) = self.effects.other_torque(input.pressure_drop_pa).at::<true>(end.angle_rad);
        if self.effects.customs.loads() {
            let Moving { angle, speed, acceleration } = moving;
            other_nm += self.effects.customs.torque_nm(&held.at(angle, speed, acceleration, dt_s));
        }
        let load_nm = self.load_inertia_kg_m2 * end.acceleration_rad_per_s2 + friction_nm + other_nm;
        MotionOutput {
            friction_torque_nm: friction_nm,
            other_torque_nm: other_nm,
            load_torque_nm: load_nm,
            measured_torque_nm: self.measurement.torque_nm(load_nm),
        }
    }
}

/// A piece behind the spring turns its phase by no more than so much, rad.
const PHASE: f64 = 1.0;
const MOST_PIECES: f64 = 8.0;

/// The way of the spring's far end between two samples: a cubic with the given angles and speeds at its ends, ahead by what the
/// damper makes of the speed.
struct FarEnd<'a> {
    input: &'a MotionInput,
    dt_s: f64,
    /// Damping over stiffness, s.
    ahead_s: f64,
}

impl FarEnd<'_> {
    /// At a part of the way, rad.
    fn at(&self, part: f64) -> f64 {
        let (start, end) = (&self.input.start, &self.input.end);
        let turn_rad = end.angle_rad - start.angle_rad;
        let beyond_start = start.speed_rad_per_s * self.dt_s - turn_rad;
        let beyond_end = end.speed_rad_per_s * self.dt_s - turn_rad;
        let rest = 1.0 - part;
        let bend = rest * beyond_start - part * beyond_end;
        let angle_rad = start.angle_rad + part * turn_rad + part * rest * bend;
        let speed = turn_rad + (rest - part) * bend - part * rest * (beyond_start + beyond_end);
        angle_rad + self.ahead_s / self.dt_s * speed
    }

    /// A straight line for the way between two parts of it: its ends, and how far the last lies beside the way. In the mean
    /// it is where the way is, since a spring makes a torque of inertia's size of what a chord cuts off.
    fn line(&self, from: f64, to: f64) -> (f64, f64, f64) {
        let (start_rad, middle_rad, end_rad) = (self.at(from), self.at(0.5 * (from + to)), self.at(to));
        let beside_rad = 2.0 / 3.0 * (middle_rad - 0.5 * (start_rad + end_rad));
        (start_rad + beside_rad, end_rad + beside_rad, beside_rad)
    }
}

fn step_behind_spring(
    params: &MotionParams,
    spring: &ValveParams,
    state: &mut MotionState,
    input: &MotionInput,
    dt_s: f64,
) -> MotionOutput {
    let pieces = params.pieces_behind_spring(dt_s).unwrap_or(1);
    let coupling = params.effects.coupling;
    let ahead_s = coupling.damping_nm_s_per_rad / coupling.stiffness_nm_per_rad;
    let way = FarEnd { input, dt_s, ahead_s };
    let mut move_along = |piece: u32| {
        let part = |piece: u32| f64::from(piece) / f64::from(pieces);
        let (command_start_rad, command_end_rad, beside_rad) = way.line(part(piece), part(piece + 1));
        let driven = ValveInput {
            command_start_rad,
            command_end_rad,
            pressure_drop_pa: input.pressure_drop_pa,
            oil_temperature_c: input.oil_temperature_c,
            current_ratio: 1.0,
        };
        let out = step(spring, &mut state.spool, &driven, dt_s / f64::from(pieces));
        (out, beside_rad)
    };
    for piece in 0..pieces - 1 {
        move_along(piece);
    }
    let (out, beside_rad) = move_along(pieces - 1);
    let carried_nm = out.motor_torque_nm - coupling.stiffness_nm_per_rad * beside_rad;
    state.friction = state.spool.friction;
    MotionOutput {
        friction_torque_nm: out.friction_torque_nm,
        other_torque_nm: out.other_torque_nm,
        load_torque_nm: carried_nm,
        measured_torque_nm: params.measurement.torque_nm(carried_nm),
    }
}

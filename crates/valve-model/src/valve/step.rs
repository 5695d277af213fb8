//! One control cycle of the valve.

use serde::{Deserialize, Serialize};

use super::input::ValveInput;
use super::params::ValveParams;
use super::shaft::{Shaft, ShaftState};
use super::substeps;
use crate::FrictionState;
use crate::friction::{AnyLaw, Law};

/// The valve at one instant: plain data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ValveState {
    /// Angle of the spool, and of the rotor where no spring lies between them, rad.
    pub angle_rad: f64,
    /// Speed of the spool, rad/s.
    pub speed_rad_per_s: f64,
    /// The contact.
    pub friction: FrictionState,
    /// Angle of the rotor, rad.
    pub rotor_angle_rad: f64,
    /// Speed of the rotor, rad/s.
    pub rotor_speed_rad_per_s: f64,
    /// Angle of the encoder's own shaft, rad: the rotor's within the play.
    pub encoder_shaft_rad: f64,
    /// Time since the state was made, s.
    pub time_s: f64,
    /// The length of sub-step that the integrator would take next, s; 0 where it has not begun.
    pub substep_s: f64,
}

impl ValveState {
    /// A valve that rests at `angle_rad` with its bristles relaxed.
    pub fn at_rest(angle_rad: f64) -> Self {
        Self {
            angle_rad,
            speed_rad_per_s: 0.0,
            friction: FrictionState::default(),
            rotor_angle_rad: angle_rad,
            rotor_speed_rad_per_s: 0.0,
            encoder_shaft_rad: angle_rad,
            time_s: 0.0,
            substep_s: 0.0,
        }
    }

    /// A valve that rests at `angle_rad` and holds a torque (N·m) by its friction, as after motion that ended there.
    pub fn holding(params: &ValveParams, angle_rad: f64, friction_torque_nm: f64) -> Self {
        if friction_torque_nm == 0.0 {
            return Self::at_rest(angle_rad);
        }
        let law = &params.friction;
        let friction = FrictionState::deflected(law, law.deflection_rad(friction_torque_nm));
        Self { friction, ..Self::at_rest(angle_rad) }
    }

    fn jump(&mut self, jump_rad: f64) {
        self.angle_rad += jump_rad;
        self.rotor_angle_rad += jump_rad;
        self.encoder_shaft_rad += jump_rad;
    }
}

/// The valve at the end of a cycle, beyond its state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ValveOutput {
    /// Torque of the motor on the rotor, its damping included, N·m.
    pub motor_torque_nm: f64,
    /// Friction torque, N·m, positive against positive speed.
    pub friction_torque_nm: f64,
    /// Torque between motor and load: J_load·dω/dt + friction + other torques, N·m.
    pub load_torque_nm: f64,
    /// What a transducer there reads, its own gain and offset included, N·m.
    pub measured_torque_nm: f64,
    /// Other torques that load the spool (flow, pressure, position), N·m: positive where the motor has to push in the
    /// direction of positive angles to hold against them.
    pub other_torque_nm: f64,
    /// Flow through the orifice, m³/s, with the sign of the pressure drop; 0 where the model has no orifice.
    pub flow_m3_per_s: f64,
    /// Mean bristle deflection, rad.
    pub bristle_deflection_rad: f64,
    /// The angle at the encoder: the rotor's, with play and eccentricity, before quantisation, noise and delay, rad.
    pub encoder_angle_rad: f64,
}

/// Moves the valve through one control cycle of `dt_s` seconds (0.1 to 10 ms).
///
/// Takes a bounded number of sub-steps whatever the parameters, state and input; a state that is no number stays one.
pub fn step(params: &ValveParams, state: &mut ValveState, input: &ValveInput, dt_s: f64) -> ValveOutput {
    match (&params.friction.law, params.full) {
        (AnyLaw::Stribeck(law), false) => step_law::<_, false>(params, law, state, input, dt_s),
        (AnyLaw::Stribeck(law), true) => step_law::<_, true>(params, law, state, input, dt_s),
        (AnyLaw::Dahl(law), false) => step_law::<_, false>(params, law, state, input, dt_s),
        (AnyLaw::Dahl(law), true) => step_law::<_, true>(params, law, state, input, dt_s),
        (AnyLaw::LuGre(law), false) => step_law::<_, false>(params, law, state, input, dt_s),
        (AnyLaw::LuGre(law), true) => step_law::<_, true>(params, law, state, input, dt_s),
        (AnyLaw::Leuven(law), false) => step_law::<_, false>(params, law, state, input, dt_s),
        (AnyLaw::Leuven(law), true) => step_law::<_, true>(params, law, state, input, dt_s),
    }
}

fn step_law<L: Law, const FULL: bool>(
    params: &ValveParams,
    law: &L,
    state: &mut ValveState,
    input: &ValveInput,
    dt_s: f64,
) -> ValveOutput {
    let end_s = state.time_s + dt_s;
    state.jump(params.measurement.jump_rad(state.time_s, end_s));
    let mut shaft = Shaft::<L, FULL>::new(params, law, input, dt_s, &state.friction);
    let start = ShaftState {
        angle: state.angle_rad,
        speed: state.speed_rad_per_s,
        z: state.friction.z,
        curve_speed: state.friction.contact.curve_speed,
        stage_speed: state.friction.contact.stage_speed,
        rotor_angle: state.rotor_angle_rad,
        rotor_speed: state.rotor_speed_rad_per_s,
    };
    let end = substeps::integrate(&mut shaft, start, &mut state.friction, dt_s, &mut state.substep_s);
    let compliant = shaft.coupling().is_some();
    state.angle_rad = end.angle;
    state.speed_rad_per_s = end.speed;
    state.friction.z = end.z;
    state.friction.contact.curve_speed = end.curve_speed;
    state.friction.contact.stage_speed = end.stage_speed;
    state.rotor_angle_rad = if compliant { end.rotor_angle } else { end.angle };
    state.rotor_speed_rad_per_s = if compliant { end.rotor_speed } else { end.speed };
    state.encoder_shaft_rad =
        params.measurement.encoder_shaft_rad(state.encoder_shaft_rad, state.rotor_angle_rad);
    let out = output(&shaft, state, &end, input, dt_s);
    state.time_s = end_s;
    state.friction.contact.clock_s += dt_s;
    out
}

fn output<L: Law, const FULL: bool>(
    shaft: &Shaft<'_, L, FULL>,
    state: &ValveState,
    end: &ShaftState<FULL>,
    input: &ValveInput,
    dt_s: f64,
) -> ValveOutput {
    let params = shaft.params;
    let torques = shaft.torques(end, dt_s, &state.friction.memory);
    ValveOutput {
        motor_torque_nm: torques.motor_nm,
        friction_torque_nm: torques.friction_nm,
        load_torque_nm: torques.load_nm,
        measured_torque_nm: params.measurement.torque_nm(torques.load_nm),
        other_torque_nm: torques.other_nm,
        flow_m3_per_s: params.orifice.map_or(0.0, |orifice| {
            orifice.flow_m3_per_s(end.angle, input.pressure_drop_pa, params.density_kg_per_m3)
        }),
        bristle_deflection_rad: end.z,
        encoder_angle_rad: params.measurement.encoder_angle_rad(state.encoder_shaft_rad),
    }
}

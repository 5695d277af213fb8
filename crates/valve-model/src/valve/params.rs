//! A valve's coefficients, derived once from its model.

use serde::{Deserialize, Serialize};

use super::customs::check_for_a_valve;
use super::effects::{Coupling, Effects};
use super::measurement::{Measurement, SensorDelay};
use super::tolerance::ANGLE_TOLERANCE;
use crate::error::positive;
use crate::friction::FrictionLaw;
use crate::motor::SpeedLimit;
use crate::{LoadParams, Model, MotorParams, OrificeParams, ParamError};

/// The errors that the integrator accepts are so many times the usual ones at most.
const COARSEST: f64 = 100.0;

/// What [`step`](crate::step) needs of a model: plain data, so that it can be handed to another process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ValveParams {
    pub(super) rotor_teeth: f64,
    pub(super) full_steps_per_rev: f64,
    pub(super) holding_torque_nm: f64,
    speed_limit: Option<SpeedLimit>,
    pub(super) damping_nm_s_per_rad: f64,
    pub(super) per_inertia: f64,
    pub(super) per_rotor_inertia: f64,
    pub(super) per_load_inertia: f64,
    pub(super) load_inertia_kg_m2: f64,
    pub(super) friction: FrictionLaw,
    /// Over which slip a contact forgets that it rested.
    pub(super) slip_length_rad: f64,
    pub(super) effects: Effects,
    /// Whether an effect changes within a cycle, or anything but friction loads the spool.
    pub(super) full: bool,
    pub(super) loaded: bool,
    pub(super) measurement: Measurement,
    pub(super) orifice: Option<OrificeParams>,
    pub(super) density_kg_per_m3: f64,
    /// The errors that the integrator accepts, in parts of the usual ones.
    pub(super) coarseness: f64,
}

impl ValveParams {
    /// Prepares a model.
    ///
    /// # Errors
    /// A parameter that is refused; no `[motor]`, no `[load]`; an `[orifice]` without `[oil]`.
    pub fn new(model: &Model) -> Result<Self, ParamError> {
        model.validate()?;
        let missing = |key, expected| ParamError::new(key, "missing", expected);
        if model.orifice.is_some() && model.oil.is_none() {
            return Err(missing("oil", "a section [oil] beside [orifice]"));
        }
        let motor = model.motor.ok_or_else(|| missing("motor", "a section [motor]"))?;
        let load = model.load.ok_or_else(|| missing("load", "a section [load]"))?;
        let folded = model.folded()?;
        let motor = folded.motor.unwrap_or(motor);
        let load = folded.load.unwrap_or(load);
        Self::prepare(&folded, &motor, load)
    }

    fn prepare(model: &Model, motor: &MotorParams, load: LoadParams) -> Result<Self, ParamError> {
        check_for_a_valve(model)?;
        let effects = Effects::new(model);
        if effects.coupling.is_there() && load.inertia_kg_m2 == 0.0 {
            let expected = "a number above zero beside the effect `coupling-compliance`";
            return Err(ParamError::new("inertia_kg_m2", load.inertia_kg_m2, expected));
        }
        let friction = FrictionLaw::new(&model.friction);
        Ok(Self {
            rotor_teeth: f64::from(motor.rotor_teeth),
            full_steps_per_rev: f64::from(motor.full_steps_per_rev),
            holding_torque_nm: motor.holding_torque_nm,
            speed_limit: motor.speed_limit(),
            damping_nm_s_per_rad: motor.damping_nm_s_per_rad,
            per_inertia: 1.0 / (motor.rotor_inertia_kg_m2 + load.inertia_kg_m2),
            per_rotor_inertia: 1.0 / motor.rotor_inertia_kg_m2,
            per_load_inertia: 1.0 / load.inertia_kg_m2.max(f64::MIN_POSITIVE),
            load_inertia_kg_m2: load.inertia_kg_m2,
            slip_length_rad: friction.slip_length_rad(),
            friction,
            full: effects.within_a_cycle() || effects.loads_the_spool(),
            loaded: effects.loads_the_spool(),
            effects,
            measurement: Measurement::new(model, motor.tooth_pitch_rad()),
            orifice: model.orifice,
            density_kg_per_m3: model.oil.map_or(0.0, |oil| oil.density_kg_per_m3),
            coarseness: 1.0,
        })
    }

    /// A spool of `load_inertia_kg_m2` on a linear spring, whose far end is where the command is: a motor of so little
    /// curvature that its sine is its argument. What the spring's damper takes of the far end's speed, who moves it gives
    /// by moving it ahead.
    pub(super) fn on_a_spring(
        model: &Model,
        load_inertia_kg_m2: f64,
        coupling: Coupling,
    ) -> Result<Self, ParamError> {
        const CURVATURE: f64 = 1e-6;
        check_for_a_valve(model)?;
        let mut effects = Effects::new(model);
        effects.coupling = Coupling::default();
        effects.detent = None;
        effects.microstep = None;
        let load = positive("inertia_kg_m2", load_inertia_kg_m2);
        load.map_err(|error| ParamError {
            expected: "a number above zero beside `coupling-compliance`",
            ..error
        })?;
        let friction = FrictionLaw::new(&model.friction);
        Ok(Self {
            rotor_teeth: CURVATURE,
            full_steps_per_rev: 0.0,
            holding_torque_nm: coupling.stiffness_nm_per_rad / CURVATURE,
            speed_limit: None,
            damping_nm_s_per_rad: coupling.damping_nm_s_per_rad,
            per_inertia: 1.0 / load_inertia_kg_m2,
            per_rotor_inertia: 0.0,
            per_load_inertia: 1.0 / load_inertia_kg_m2,
            load_inertia_kg_m2,
            slip_length_rad: friction.slip_length_rad(),
            friction,
            full: effects.within_a_cycle() || effects.loads_the_spool(),
            loaded: effects.loads_the_spool(),
            effects,
            measurement: Measurement::new(model, 0.0),
            orifice: None,
            density_kg_per_m3: 0.0,
            coarseness: 1.0,
        })
    }

    /// Accepts errors of the angle up to `angle_error_rad` in a sub-step, and of all else in proportion: for who simulates often
    /// and measures by much more. It is 7e-11 rad without, and no less; beyond a hundred times that nothing gets quicker.
    #[must_use]
    pub fn accepting(mut self, angle_error_rad: f64) -> Self {
        self.coarseness = (angle_error_rad / ANGLE_TOLERANCE).clamp(1.0, COARSEST);
        self
    }

    /// The torque that the windings can hold while the command turns at `speed_rad_per_s`, N·m.
    pub(super) fn available_torque_nm(&self, speed_rad_per_s: f64) -> f64 {
        let part = self.speed_limit.map_or(1.0, |limit| limit.torque_part(speed_rad_per_s));
        self.holding_torque_nm * part
    }

    /// How late the measured angle is against the command (effect `sensor-delay`). [`step`](crate::step) gives the
    /// angle of the moment; who samples it delays it.
    pub fn sensor_delay(&self) -> SensorDelay {
        self.measurement.delay
    }

    /// The friction law with the effects that change its numbers.
    pub fn friction_law(&self) -> &FrictionLaw {
        &self.friction
    }

    /// Half the play between the rotor and the encoder's shaft, rad.
    pub fn backlash_half_width_rad(&self) -> f64 {
        self.measurement.backlash_half_width_rad
    }
}

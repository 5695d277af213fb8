//! What the drive moves: the simulated valve, driven micro-step by micro-step.

use thiserror::Error;
use valve_model::{Model, MotorParams, ParamError, ValveInput, ValveParams, ValveState};

/// A model that makes no valve.
#[derive(Debug, Error)]
pub enum ValveError {
    /// A number that no valve has.
    #[error("model: {0}")]
    Params(#[from] ParamError),
    /// Without a motor nothing turns.
    #[error("model: no section [motor]")]
    NoMotor,
}

/// A valve with its motor.
#[derive(Debug, Clone)]
pub struct Valve {
    params: ValveParams,
    motor: MotorParams,
    state: ValveState,
}

impl Valve {
    /// A valve at rest at `angle_rad`.
    ///
    /// # Errors
    /// `ValveError`, where the model has no motor or can't be.
    pub fn new(model: &Model, angle_rad: f64) -> Result<Self, ValveError> {
        let motor = model.motor.ok_or(ValveError::NoMotor)?;
        Ok(Self { params: ValveParams::new(model)?, motor, state: ValveState::at_rest(angle_rad) })
    }

    /// Micro-steps per revolution.
    pub fn units_per_revolution(&self) -> u32 {
        (std::f64::consts::TAU / self.motor.microstep_angle_rad()).round() as u32
    }

    /// Moves for `seconds` while the command goes from one micro-step to another.
    pub(crate) fn step(&mut self, start: i64, end: i64, energised: bool, seconds: f64) {
        let microstep_rad = self.motor.microstep_angle_rad();
        let input = ValveInput {
            command_start_rad: start as f64 * microstep_rad,
            command_end_rad: end as f64 * microstep_rad,
            pressure_drop_pa: 0.0,
            oil_temperature_c: 40.0,
            current_ratio: f64::from(u8::from(energised)),
        };
        valve_model::step(&self.params, &mut self.state, &input, seconds);
    }

    /// The spool's angle as an encoder of one count a micro-step reads it.
    pub(crate) fn microsteps(&self) -> i64 {
        let turns = self.state.angle_rad / std::f64::consts::TAU;
        (turns * f64::from(self.units_per_revolution())).round() as i64
    }

    /// The spool's angle, rad.
    pub fn angle_rad(&self) -> f64 {
        self.state.angle_rad
    }
}

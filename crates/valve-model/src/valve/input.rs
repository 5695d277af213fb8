//! What acts on a valve during one cycle.

use serde::{Deserialize, Serialize};

/// What acts on the valve during one cycle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ValveInput {
    /// θ_cmd at the beginning of the cycle, rad; linear in time until its end.
    pub command_start_rad: f64,
    /// θ_cmd at the end of the cycle, rad.
    pub command_end_rad: f64,
    /// Pressure drop over the orifice, Pa.
    pub pressure_drop_pa: f64,
    /// Oil temperature, °C.
    pub oil_temperature_c: f64,
    /// The part of the rated current that the windings carry; without any, only the motor's damping is left of its torque.
    pub current_ratio: f64,
}

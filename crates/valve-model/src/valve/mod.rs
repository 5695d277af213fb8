//! The whole valve on one shaft: motor, friction, orifice, and the integration of a control cycle.

mod crossing;
mod customs;
mod effects;
mod input;
mod linear;
mod measured;
mod measurement;
mod met;
mod motion;
mod pace;
mod params;
mod robust;
mod rodas;
mod shaft;
mod step;
mod substeps;
mod tolerance;

pub use effects::growth_reached;
pub use input::ValveInput;
pub use measured::{half_way, measured_motion_step};
pub use measurement::SensorDelay;
pub use motion::{MotionInput, MotionOutput, MotionParams, MotionSample, MotionState, motion_step};
pub use params::ValveParams;
pub use step::{ValveOutput, ValveState, step};

//! The whole valve on one shaft: motor, friction, orifice, and the integration of a control cycle.

mod effects;
mod linear;
mod measurement;
mod motion;
mod params;
mod robust;
mod rodas;
mod shaft;
mod step;

pub use motion::{Motion, MotionInput, MotionOutput, MotionParams, MotionState, motion_step};
pub use params::ValveParams;
pub use step::{ValveInput, ValveOutput, ValveState, step};

//! Friction laws, seal calculation, motor, orifice, shaft, effects, and the integrator.
//!
//! Everything here is a `Params` (immutable, validated once), a `State` (plain data) and a `step`: no clock, file,
//! socket, thread or heap. SI units and radians throughout.
#![forbid(unsafe_code)]

mod bench_rig;
mod clearance;
mod effect;
mod error;
mod friction;
mod load;
mod model;
mod motor;
mod oil;
mod orifice;
mod seals;
mod valve;
mod window;

pub use clearance::ClearanceParams;
pub use effect::{
    ActsOn, Condition, Covariate, CustomLaw, Effect, EffectId, EffectSpec, EffectValue, Grid, Label,
    MOST_CUSTOM, ModelNumber, ParameterSpec, Rule, SeenIn, ValueKind, check_expression,
    check_expression_in_units, parameter_names,
};
pub use error::ParamError;
pub use expression::{Dimension, ExpressionError, unit};
pub use friction::{
    ContactPast, DahlParams, FrictionLaw, FrictionParams, FrictionState, LeuvenParams, LuGreParams,
    StribeckParams,
};
pub use load::LoadParams;
pub use model::Model;
pub use motor::{MotorElectrical, MotorParams};
pub use oil::OilParams;
pub use orifice::{OrificeError, OrificeParams};
pub use seals::SealParams;
pub use valve::{
    MotionInput, MotionOutput, MotionParams, MotionSample, MotionState, SensorDelay, ValveInput, ValveOutput,
    ValveParams, ValveState, growth_reached, half_way, measured_motion_step, motion_step, step,
};
pub use window::{Window, WindowTable};

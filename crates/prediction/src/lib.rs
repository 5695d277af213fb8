//! Measured runs through the model: the torque that a measured motion takes, the angle that a command leads to.
//!
//! Pure calculation on runs in memory: no file, clock or thread. A run with `torque` is predicted from its measured
//! angle, without a motor; one with `angle_command` and no `torque` from its command. What is predicted takes the place
//! of what was measured, so that a long run needs no second copy; the other channels are only read.
#![forbid(unsafe_code)]

mod angle;
mod conditions;
mod delay;
mod error;
mod noise;
mod penalty;
mod rests;
mod sides;
mod smoothing;
mod torque;

pub use angle::encoder_angle_after;
pub use delay::delay;
pub use error::PredictionError;
pub use noise::{Noise, goes_through_steps};
pub use smoothing::{MOMENT_REACH, Smoother, motion_at, motion_through, sharper};

use log_data::{Channel, Run};
use valve_model::{Covariate, EffectId, Model};

/// What a contact brings along from the runs before.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Past {
    /// Time at rest, s.
    pub rest_s: f64,
    /// Distance travelled, rad.
    pub distance_rad: f64,
}

/// How the bristle's deflection at a run's start, which no record holds, was dealt with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// From the torque at the start, measured or the motor's, rad.
    Estimated {
        /// The deflection, rad.
        deflection_rad: f64,
        /// The one from which it came there, rad, where the bristles remember it; 0: relaxed.
        came_from_rad: f64,
    },
    /// Nothing to estimate it from: what depends on it is NaN.
    LeftOut,
}

/// What was done with a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Predicted {
    /// The channel predicted.
    pub channel: Channel,
    /// How the run began.
    pub start: Start,
    /// Samples left out.
    pub left_out: usize,
    /// What the encoder adds to the measured angle.
    pub noise: Noise,
    /// The contact at the run's end.
    pub end: Past,
}

/// The channel that the model predicts of a run.
///
/// # Errors
/// [`PredictionError::TooShort`]; [`PredictionError::NothingToPredict`].
pub fn predicted_channel(run: &Run) -> Result<Channel, PredictionError> {
    let name = || run.name.clone();
    if run.len() < 2 {
        return Err(PredictionError::TooShort { run: name(), found: run.len() });
    }
    match (&run.torque_nm, &run.angle_command_rad) {
        (Some(_), _) => Ok(Channel::Torque),
        (None, Some(_)) => Ok(Channel::Angle),
        (None, None) => Err(PredictionError::NothingToPredict { run: name() }),
    }
}

/// Puts the model's torque, or angle, in the place of the measured one. Every other channel stays.
///
/// The run has passed [`Run::check`].
///
/// # Errors
/// [`PredictionError`]; the run is then of no further use.
pub fn predict(run: &mut Run, model: &Model, past: &Past) -> Result<Predicted, PredictionError> {
    let channel = predicted_channel(run)?;
    let mut values = run.take_channel(channel).unwrap_or_default();
    let found = predict_taken(run, channel, &mut values, model, past);
    run.set_channel(channel, values);
    found
}

/// The same for a run whose `channel` was taken out of it (by [`Run::take_channel`]): `values` are the measured ones
/// before, the model's afterwards, in the channel's unit. Others may read the run meanwhile.
///
/// # Errors
/// [`PredictionError`]; the values are then of no further use.
pub fn predict_taken(
    run: &Run,
    channel: Channel,
    values: &mut [f64],
    model: &Model,
    past: &Past,
) -> Result<Predicted, PredictionError> {
    match channel {
        Channel::Torque => torque::predict(run, model, past, values),
        _ => angle::predict(run, model, past, values),
    }
}

/// Whether the model's friction depends on what went on in the runs before.
pub fn depends_on_past(model: &Model) -> bool {
    let with_memory = [EffectId::DwellStiction, EffectId::HydraulicLock, EffectId::WearDrift];
    model.effects.iter().any(|effect| {
        let asked = [Covariate::TimeAtRest, Covariate::Distance];
        with_memory.contains(&effect.id()) || asked.into_iter().any(|of| effect.depends_on(of))
    })
}

//! Why a run can't be predicted.

use log_data::Channel;
use thiserror::Error;
use valve_model::{EffectId, ParamError};

/// What is wrong with a run, or with the model for it. Rows count from 1.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PredictionError {
    /// A run too short to move.
    #[error("run {run}: {found} sample(s), expected at least 2")]
    TooShort {
        /// The run.
        run: String,
        /// Its samples.
        found: usize,
    },
    /// Nothing that the model predicts.
    #[error(
        "run {run}: neither torque nor angle_command, expected one of them: torque for a torque log, angle_command for an angle log"
    )]
    NothingToPredict {
        /// The run.
        run: String,
    },
    /// A channel that the model's effects depend on.
    #[error("run {run}: no {channel}, expected it: the model's effect {effect} depends on it")]
    MissingChannel {
        /// The run.
        run: String,
        /// The channel.
        channel: Channel,
        /// The effect.
        effect: EffectId,
    },
    /// A sample that the model needs is missing.
    #[error(
        "run {run}, row {row} (time {time_s} s): {channel} is NaN, expected a number; up to a fifth of a run is bridged, more by import's fill(x): --map {channel}='fill(...)'"
    )]
    MissingSample {
        /// The run.
        run: String,
        /// The row.
        row: usize,
        /// The time there.
        time_s: f64,
        /// The channel.
        channel: Channel,
    },
    /// The model lacks what the prediction needs.
    #[error("run {run}: the model for it: {source}")]
    Model {
        /// The run.
        run: String,
        /// What is missing or refused.
        source: ParamError,
    },
}

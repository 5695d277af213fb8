//! Why a log can't be held against a model.

use log_data::Channel;
use prediction::PredictionError;
use thiserror::Error;
use valve_model::ParamError;

/// What is wrong with the log, or with the model for it. Rows count from 1.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DiagnosisError {
    /// A run from which nothing can be learnt.
    #[error("run {run}, row {found}: the run ends after {found} samples, expected at least {expected}")]
    TooShort {
        /// The run.
        run: String,
        /// Its samples.
        found: usize,
        /// The least that are of use.
        expected: usize,
    },
    /// A sample is missing.
    #[error("run {run}, row {row} (time {time_s} s): {channel} is NaN, expected a number")]
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
    /// A valve that never moves shows no friction.
    #[error("run {run}, rows 1 to {rows}: angle is {angle_rad} rad throughout, expected it to change")]
    NeverMoves {
        /// The run.
        run: String,
        /// Its rows.
        rows: usize,
        /// The angle.
        angle_rad: f64,
    },
    /// The run can't be predicted.
    #[error(transparent)]
    Prediction(#[from] PredictionError),
    /// The model can't be simulated.
    #[error("run {run}, row 1: the model can't be simulated: {source}")]
    Model {
        /// The first run that it was wanted for.
        run: String,
        /// What is refused or missing.
        source: ParamError,
    },
    /// The model gives no number.
    #[error("run {run}, row {row}: the model's {channel} is {found}, expected a finite number")]
    NotFinite {
        /// The run.
        run: String,
        /// The row.
        row: usize,
        /// The channel predicted.
        channel: Channel,
        /// What came out.
        found: f64,
    },
}

/// What came of numbers that were tried; `None` where the model doesn't take them.
pub(crate) fn if_possible<T>(tried: Result<T, DiagnosisError>) -> Result<Option<T>, DiagnosisError> {
    match tried {
        Err(DiagnosisError::Model { .. }) => Ok(None),
        tried => tried.map(Some),
    }
}

//! Why a log can't be compared with a model.

use log_data::Channel;
use prediction::PredictionError;
use thiserror::Error;
use valve_model::ParamError;

/// What is wrong with the log, or with the model for it. Rows count from 1.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DiagnosisError {
    /// A run that is too short.
    #[error("run {run}, row {found}: the run ends after {found} samples, expected at least {expected}")]
    TooShort {
        /// The run.
        run: String,
        /// Its samples.
        found: usize,
        /// The least number required.
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
        /// The value predicted.
        found: f64,
    },
}

/// The result of a trial; `None` if the model rejects its parameter values.
pub(crate) fn if_possible<T>(tried: Result<T, DiagnosisError>) -> Result<Option<T>, DiagnosisError> {
    match tried {
        Err(DiagnosisError::Model { .. }) => Ok(None),
        tried => tried.map(Some),
    }
}

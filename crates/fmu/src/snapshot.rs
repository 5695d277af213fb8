//! The whole state of a unit: kept, given back, and written as bytes.

use crate::UnitError;
use crate::variables::INPUTS;
use serde::{Deserialize, Serialize};
use valve_model::{ValveOutput, ValveState};

/// A state of a unit: everything that a step depends on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    pub(crate) valve: ValveState,
    pub(crate) inputs: [f64; INPUTS],
    /// The command at the end of the last step.
    pub(crate) command_rad: f64,
    pub(crate) output: Option<ValveOutput>,
    pub(crate) start_angle_rad: f64,
    pub(crate) lost_at_start: i64,
    pub(crate) time_s: f64,
    pub(crate) runs: bool,
    /// The model's numbers as they are set.
    pub(crate) numbers: Vec<f64>,
}

impl Snapshot {
    /// As bytes, every number bit for bit, behind a check sum.
    ///
    /// # Errors
    /// None that is known.
    pub fn to_bytes(&self) -> Result<Vec<u8>, UnitError> {
        let body = postcard::to_stdvec(self).map_err(|_| UnitError::State)?;
        let mut bytes = crc32c::crc32c(&body).to_le_bytes().to_vec();
        bytes.extend(body);
        Ok(bytes)
    }

    /// What [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// [`UnitError::State`] of other bytes.
    pub fn of_bytes(bytes: &[u8]) -> Result<Self, UnitError> {
        let (sum, body) = bytes.split_first_chunk::<4>().ok_or(UnitError::State)?;
        if u32::from_le_bytes(*sum) != crc32c::crc32c(body) {
            return Err(UnitError::State);
        }
        postcard::from_bytes(body).map_err(|_| UnitError::State)
    }
}

//! What is wrong with a parameter, and the checks that find it.

use thiserror::Error;

/// A parameter that no valve can have.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("`{key}` is {found}, expected {expected}")]
pub struct ParamError {
    /// The key as the model file spells it.
    pub key: &'static str,
    /// The value found, as text.
    pub found: String,
    /// What would have been accepted.
    pub expected: &'static str,
}

impl ParamError {
    pub(crate) fn new(key: &'static str, found: impl ToString, expected: &'static str) -> Self {
        Self { key, found: found.to_string(), expected }
    }
}

/// Refuses `value` unless `accepted` holds; NaN and infinities are never accepted.
pub(crate) fn require(
    accepted: bool,
    key: &'static str,
    value: f64,
    expected: &'static str,
) -> Result<(), ParamError> {
    if accepted && value.is_finite() { Ok(()) } else { Err(ParamError::new(key, value, expected)) }
}

/// A finite number above zero.
pub(crate) fn positive(key: &'static str, value: f64) -> Result<(), ParamError> {
    require(value > 0.0, key, value, "a finite number above zero")
}

/// A finite number, zero or above.
pub(crate) fn not_negative(key: &'static str, value: f64) -> Result<(), ParamError> {
    require(value >= 0.0, key, value, "a finite number, zero or above")
}

/// Any finite number.
pub(crate) fn finite(key: &'static str, value: f64) -> Result<(), ParamError> {
    require(true, key, value, "a finite number")
}

/// A count between two bounds, both included.
pub(crate) fn count(
    key: &'static str,
    value: u32,
    range: std::ops::RangeInclusive<u32>,
    expected: &'static str,
) -> Result<(), ParamError> {
    if range.contains(&value) { Ok(()) } else { Err(ParamError::new(key, value, expected)) }
}

//! What the guard is set to, checked once, and the bound on stopping that follows from it.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// What the drive does once it has stopped by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AfterStop {
    /// The windings stay energised and hold the position.
    Hold,
    /// The windings are switched off.
    DeEnergise,
}

/// Limits and reactions of the guard.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Params {
    /// Length of a cycle, s.
    pub period_s: f64,
    /// Angle of one micro-step, rad.
    pub microstep_angle_rad: f64,
    /// The highest pulse rate, micro-steps per second.
    pub max_pulse_rate_hz: f64,
    /// The greatest change of the pulse rate while following, micro-steps per second².
    pub max_pulse_acceleration_hz_per_s: f64,
    /// The change of the pulse rate in a quick stop, micro-steps per second².
    pub quick_stop_deceleration_hz_per_s: f64,
    /// What follows a stop that the drive made by itself.
    pub after_stop: AfterStop,
    /// So many cycles in a row without a command are silence.
    pub silence_cycles: u64,
}

/// A parameter that no drive can have.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("`{key}` is {found}, expected {expected}")]
pub struct DriveError {
    /// The field's name.
    pub key: &'static str,
    /// The value found.
    pub found: f64,
    /// What would have been accepted.
    pub expected: &'static str,
}

/// A rate must still be a sensible number when squared or summed over a life of rotation.
const LARGEST: f64 = 1e15;

/// Cycles beyond this are no stop any more.
const LONGEST_STOP_CYCLES: f64 = 1e12;

impl Params {
    /// Checks all numbers.
    ///
    /// # Errors
    /// The first one that is not finite, not above zero, or out of proportion.
    pub fn validate(&self) -> Result<(), DriveError> {
        let positive = [
            ("period_s", self.period_s),
            ("microstep_angle_rad", self.microstep_angle_rad),
            ("max_pulse_rate_hz", self.max_pulse_rate_hz),
            ("max_pulse_acceleration_hz_per_s", self.max_pulse_acceleration_hz_per_s),
            ("quick_stop_deceleration_hz_per_s", self.quick_stop_deceleration_hz_per_s),
        ];
        for (key, found) in positive {
            if !(found > 0.0 && found <= LARGEST) {
                return Err(DriveError { key, found, expected: "a number above 0, at most 1e15" });
            }
        }
        if self.silence_cycles == 0 {
            return Err(DriveError { key: "silence_cycles", found: 0.0, expected: "1 or more" });
        }
        if self.ramp_cycles() > LONGEST_STOP_CYCLES {
            let found = self.quick_stop_deceleration_hz_per_s;
            let expected = "enough to stop from `max_pulse_rate_hz` within 1e12 cycles";
            return Err(DriveError { key: "quick_stop_deceleration_hz_per_s", found, expected });
        }
        Ok(())
    }

    /// The longest way in a cycle, micro-steps.
    pub(crate) fn max_travel(&self) -> f64 {
        self.max_pulse_rate_hz * self.period_s
    }

    /// The greatest change of a cycle's way from one cycle to the next while following, micro-steps.
    pub(crate) fn max_change(&self) -> f64 {
        self.max_pulse_acceleration_hz_per_s * self.period_s * self.period_s
    }

    /// The same in a quick stop, micro-steps.
    pub(crate) fn quick_stop_change(&self) -> f64 {
        self.quick_stop_deceleration_hz_per_s * self.period_s * self.period_s
    }

    /// Cycles of the ramp from the highest rate to zero, the last one at zero.
    fn ramp_cycles(&self) -> f64 {
        (self.max_travel() / self.quick_stop_change()).ceil()
    }
}

/// Cycles from the one of the last command to the first at zero rate, at most: the silence, the ramp from the
/// highest rate, and one for rounding.
pub fn stop_cycles_bound(params: &Params) -> u64 {
    params.silence_cycles.saturating_add(params.ramp_cycles() as u64).saturating_add(1)
}

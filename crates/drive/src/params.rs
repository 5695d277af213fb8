//! The guard's settings, validated once, and the bound on its stopping time.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// An encoder must read the same angle for this long before the valve counts as standing still, s: longer than half a
/// period of the rotor's resonance, so that a turning point of the oscillation does not look like rest.
pub const STANDSTILL_S: f64 = 0.005;

/// What the drive does after it has stopped by itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AfterStop {
    /// The windings stay energised and hold the position.
    Hold,
    /// The windings are switched off.
    DeEnergise,
    /// The drive moves to a neutral position and holds there.
    Neutral {
        /// The position, micro-steps.
        microsteps: i64,
        /// Pulse rate of that move, micro-steps per second.
        pulse_rate_hz: f64,
        /// Longest possible move, micro-steps, from the limits of motion.
        longest_way: f64,
    },
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
    /// The largest pulse acceleration while following, micro-steps per second².
    pub max_pulse_acceleration_hz_per_s: f64,
    /// The deceleration of a quick stop, micro-steps per second².
    pub quick_stop_deceleration_hz_per_s: f64,
    /// What follows a stop by the drive itself.
    pub after_stop: AfterStop,
    /// Consecutive cycles without a command after which the drive stops by itself.
    pub silence_cycles: u64,
    /// Cycles from the command until the windings carry current. For the simulator; a bus bridge waits for its drive.
    pub energise_cycles: u64,
    /// Lower limit of the angle, rad; holds for a homed valve.
    pub lowest_angle_rad: Option<f64>,
    /// Upper limit of the angle, rad; holds for a homed valve.
    pub highest_angle_rad: Option<f64>,
    /// An encoder that moves less than this for [`STANDSTILL_S`] stands still, rad.
    pub standstill_rad: f64,
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

/// Upper bound of all rates and angles, so that squares and sums over a valve's life stay exact enough.
const LARGEST: f64 = 1e15;

/// Longest quick stop accepted, cycles.
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
            ("standstill_rad", self.standstill_rad),
        ];
        for (key, found) in positive {
            if !(found > 0.0 && found <= LARGEST) {
                return Err(DriveError { key, found, expected: "a number above 0, at most 1e15" });
            }
        }
        if let AfterStop::Neutral { pulse_rate_hz, longest_way, .. } = self.after_stop {
            if !(pulse_rate_hz > 0.0 && pulse_rate_hz <= self.max_pulse_rate_hz) {
                let (key, found) = ("after_stop.pulse_rate_hz", pulse_rate_hz);
                return Err(DriveError { key, found, expected: "above 0, at most `max_pulse_rate_hz`" });
            }
            if !(0.0..=LARGEST).contains(&longest_way) {
                let (key, found) = ("after_stop.longest_way", longest_way);
                return Err(DriveError { key, found, expected: "0 to 1e15" });
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

    /// Largest travel in a cycle, micro-steps.
    pub(crate) fn max_travel(&self) -> f64 {
        self.max_pulse_rate_hz * self.period_s
    }

    /// Largest change of the travel from one cycle to the next while following, micro-steps.
    pub(crate) fn max_change(&self) -> f64 {
        self.max_pulse_acceleration_hz_per_s * self.period_s * self.period_s
    }

    /// Largest distance of a healthy controller's command from the drive's position, micro-steps, after `missed` cycles in
    /// which the drive coasted: the drive at full rate one way, the controller at full rate the other.
    pub(crate) fn largest_jump(&self, missed: u64) -> f64 {
        self.max_travel() * (2.0 * missed as f64 + 3.0)
    }

    /// Cycles for which an encoder has to rest before the valve counts as still.
    pub(crate) fn standstill_cycles(&self) -> u64 {
        (STANDSTILL_S / self.period_s).ceil() as u64
    }

    /// Change of the travel from one cycle to the next in a quick stop, micro-steps.
    pub(crate) fn quick_stop_change(&self) -> f64 {
        self.quick_stop_deceleration_hz_per_s * self.period_s * self.period_s
    }

    /// These settings with the pulse rate of the move to the neutral position.
    pub(crate) fn towards_neutral(&self, pulse_rate_hz: f64) -> Self {
        Self { max_pulse_rate_hz: pulse_rate_hz, ..*self }
    }

    /// Upper bound of the move to the neutral position, cycles: constant rate with a ramp at either end.
    fn neutral_cycles(&self) -> u64 {
        let AfterStop::Neutral { pulse_rate_hz, longest_way, .. } = self.after_stop else { return 0 };
        let way = pulse_rate_hz * self.period_s;
        ((longest_way / way).ceil() + 2.0 * (way / self.max_change()).ceil()) as u64 + 2
    }

    /// Cycles of a quick stop from the highest rate; the last one is at zero rate.
    fn ramp_cycles(&self) -> f64 {
        (self.max_travel() / self.quick_stop_change()).ceil()
    }
}

/// Upper bound of the cycles from the last command to standstill: the silence, the ramp from the highest rate, the move to
/// a neutral position where there is one, and one cycle for rounding.
pub fn stop_cycles_bound(params: &Params) -> u64 {
    let ramp = params.silence_cycles.saturating_add(params.ramp_cycles() as u64).saturating_add(1);
    ramp.saturating_add(params.neutral_cycles())
}

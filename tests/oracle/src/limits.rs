//! What a run is held to.

/// The driver's limits and reactions, as the scenario has them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Length of a cycle, s.
    pub period_s: f64,
    /// The highest pulse rate, Hz.
    pub max_pulse_rate_hz: f64,
    /// The greatest change of the pulse rate while following, Hz/s.
    pub max_pulse_acceleration_hz_per_s: f64,
    /// The change of the pulse rate in a quick stop, Hz/s.
    pub quick_stop_deceleration_hz_per_s: f64,
    /// So many cycles without a command are silence.
    pub silence_cycles: u64,
    /// Cycles from a command's own cycle to the one in which the drive follows it: 0, or 1 for a slow bus.
    pub command_delay_cycles: u64,
    /// Cycles from the one in which an order to arm is obeyed to the first command to follow, at most: until the windings
    /// carry current and the drive says that it holds.
    pub arming_cycles: u64,
    /// After a stop that the drive made by itself it may move on, to a neutral angle, at most at this rate; 0 where it
    /// may not.
    pub neutral_pulse_rate_hz: f64,
}

impl Limits {
    /// The most pulses in a cycle.
    pub(crate) fn most_pulses(&self) -> f64 {
        self.max_pulse_rate_hz * self.period_s + 1.0
    }

    /// By how much two cycles' pulses may differ while following.
    pub(crate) fn most_change(&self) -> f64 {
        self.max_pulse_acceleration_hz_per_s * self.period_s * self.period_s + 2.0
    }

    /// The same where the rate falls.
    pub(crate) fn most_fall(&self) -> f64 {
        self.most_change().max(self.quick_stop_deceleration_hz_per_s * self.period_s * self.period_s + 2.0)
    }

    /// Cycles with pulses in a ramp to zero that begins after a cycle of so many.
    pub fn ramp_cycles(&self, pulses: u64) -> u64 {
        let each = self.quick_stop_deceleration_hz_per_s * self.period_s * self.period_s;
        ((pulses as f64 + 1.0) / each).ceil() as u64
    }

    /// From the last command that is to be followed to the last cycle that may have pulses, at so many a cycle.
    pub fn cycles_after_silence(&self, pulses: u64) -> u64 {
        self.silence_cycles + self.command_delay_cycles + self.ramp_cycles(pulses)
    }
}

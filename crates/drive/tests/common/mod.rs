//! What the tests of the guard share.

use drive::{AfterStop, Params};

/// At most 600 micro-steps a cycle, 40 more or less each cycle, 100 less in a quick stop.
pub const PARAMS: Params = Params {
    period_s: 1e-3,
    microstep_angle_rad: 5.585e-5,
    max_pulse_rate_hz: 600e3,
    max_pulse_acceleration_hz_per_s: 40e6,
    quick_stop_deceleration_hz_per_s: 100e6,
    after_stop: AfterStop::Hold,
    silence_cycles: 3,
    energise_cycles: 0,
    lowest_angle_rad: None,
    highest_angle_rad: None,
    standstill_rad: 1e-4,
};

//! What the tests of the guard share.

// Not every test uses all of it.
#![allow(dead_code)]

use drive::{AfterStop, Output, Params, Sensors, State};
use signals::StepCommand;

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

pub const PERIOD_S: f64 = PARAMS.period_s;

/// A cycle of a drive that has no encoder.
pub fn step(params: &Params, state: &mut State, cycle: u64, command: Option<&StepCommand>) -> Output {
    drive::step(params, state, cycle, command, &Sensors::default())
}

pub fn follow(position: f64, way: f64) -> StepCommand {
    StepCommand {
        position_microsteps: position.round() as i64,
        position_unrounded: position,
        pulse_rate_hz: way / PERIOD_S,
        follow: 1,
        follow_id: 1,
        energise: 1,
        ..StepCommand::default()
    }
}

/// The same under a later arming than any other here.
pub fn follow_anew(position: f64, way: f64) -> StepCommand {
    StepCommand { follow_id: u64::MAX, ..follow(position, way) }
}

pub fn hold() -> StepCommand {
    StepCommand { energise: 1, ..StepCommand::default() }
}

pub fn way(motion: &Output) -> f64 {
    motion.pulse_rate_hz * PERIOD_S
}

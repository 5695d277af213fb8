//! The guard's bounds as numbers worked out by hand, and what a drive on a bus keeps when its position is told anew.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::PARAMS;
use drive::{AfterStop, Mode, Params, Sensors, State, step, stop_cycles_bound};
use signals::StepCommand;

#[test]
fn the_bound_of_a_stop_is_silence_ramp_move_and_rounding() {
    // 600 micro-steps a cycle, 100 less in each: 6 cycles; 3 of silence; 1 for rounding.
    assert_eq!(stop_cycles_bound(&PARAMS), 10);
    // 10,000 micro-steps at 50 a cycle: 200 cycles; a ramp to 50 by 40 a cycle at either end: 2 each; 2 to turn back.
    let after_stop = AfterStop::Neutral { microsteps: 0, pulse_rate_hz: 50e3, longest_way: 10_000.0 };
    assert_eq!(stop_cycles_bound(&Params { after_stop, ..PARAMS }), 10 + 200 + 4 + 2);
}

#[test]
fn the_ends_of_the_ranges() {
    let valid = |change: fn(&mut Params)| {
        let mut params = PARAMS;
        change(&mut params);
        params.validate().is_ok()
    };
    assert!(valid(|_| {}));
    assert!(valid(|params| params.max_pulse_acceleration_hz_per_s = 1e15));
    assert!(!valid(|params| params.max_pulse_acceleration_hz_per_s = 1.1e15));
    assert!(!valid(|params| params.standstill_rad = 0.0));
    assert!(!valid(|params| params.silence_cycles = 0));
    let neutral = |pulse_rate_hz| AfterStop::Neutral { microsteps: 0, pulse_rate_hz, longest_way: 1.0 };
    assert!(Params { after_stop: neutral(600e3), ..PARAMS }.validate().is_ok());
    assert!(Params { after_stop: neutral(600.1e3), ..PARAMS }.validate().is_err());
    assert!(Params { after_stop: neutral(0.0), ..PARAMS }.validate().is_err());
}

#[test]
fn a_position_told_anew_keeps_mode_silence_and_newest_command() {
    let mut state = State::at_rest_energised(0);
    let command = StepCommand { follow: 1, follow_id: 1, energise: 1, ..StepCommand::default() };
    for cycle in 5..8 {
        let heard = (cycle == 5).then_some(&command);
        step(&PARAMS, &mut state, cycle, heard, &Sensors::default());
    }
    assert_eq!((state.mode(), state.missed_cycles(), state.command_cycle()), (Mode::Following, 2, 5));
    state.rebase(1234, false);
    assert_eq!((state.mode(), state.missed_cycles(), state.command_cycle()), (Mode::Following, 2, 5));
    assert_eq!((state.accepted_microsteps(), state.energised()), (1234, false));
}

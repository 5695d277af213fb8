//! The guard case by case: the latch, current, missed cycles, the neutral position, refused commands, a new zero.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::{PARAMS, follow, follow_anew, hold, step, way};
use drive::{AfterStop, Mode, Params, Sensors, State, stop_cycles_bound};
use signals::{FaultCode, StepCommand, validity};

/// A drive that has been stopped by silence from a rotation.
fn stopped(params: &Params) -> (State, u64) {
    let mut state = State::at_rest_energised(1000);
    let mut position = 1000.0;
    let mut cycle = 0;
    for i in 0..20 {
        position += 30.3 * f64::from(i);
        step(params, &mut state, cycle, Some(&follow(position, 30.3 * f64::from(i))));
        cycle += 1;
    }
    for _ in 0..stop_cycles_bound(params) {
        step(params, &mut state, cycle, None);
        cycle += 1;
    }
    assert_eq!(state.mode(), Mode::StoppedItself);
    (state, cycle)
}

#[test]
fn the_latch_opens_by_not_following_and_then_only_where_the_drive_stands() {
    let params = PARAMS;
    let (mut state, cycle) = stopped(&params);
    let stood = state.accepted_microsteps();
    let motion = step(&params, &mut state, cycle, Some(&hold()));
    assert_eq!((state.mode(), motion.fault), (Mode::Released, FaultCode::None));
    let motion = step(&params, &mut state, cycle + 1, Some(&follow_anew(stood as f64 + 5.0, 0.0)));
    assert_eq!((state.mode(), state.accepted_microsteps()), (Mode::Released, stood));
    assert!(motion.flags & validity::LIMITED != 0, "a command that is not followed must show");
    step(&params, &mut state, cycle + 2, Some(&follow_anew(stood as f64, 0.0)));
    assert_eq!(state.mode(), Mode::Following);
    step(&params, &mut state, cycle + 3, Some(&follow_anew(stood as f64 + 5.0, 5.0)));
    assert_eq!(state.accepted_microsteps(), stood + 5);
}

#[test]
fn the_latch_does_not_open_in_motion() {
    let params = PARAMS;
    let mut state = State::at_rest_energised(0);
    let mut position = 0.0;
    for i in 0..16 {
        position += 40.0 * f64::from(i);
        step(&params, &mut state, 0, Some(&follow(position, 40.0 * f64::from(i))));
    }
    for _ in 0..params.silence_cycles + 1 {
        step(&params, &mut state, 0, None);
    }
    for _ in 0..4 {
        let motion = step(&params, &mut state, 0, Some(&hold()));
        assert!(motion.flags & validity::STANDSTILL == 0);
        assert_eq!(motion.fault, FaultCode::CommandSilent);
    }
    for _ in 0..3 {
        step(&params, &mut state, 0, Some(&hold()));
    }
    assert_eq!(state.mode(), Mode::Released);
}

#[test]
fn current_goes_only_at_standstill() {
    let params = Params { after_stop: AfterStop::DeEnergise, ..PARAMS };
    let (mut state, cycle) = stopped(&params);
    assert!(!state.energised());
    let stood = state.accepted_microsteps();
    step(&params, &mut state, cycle, Some(&follow(0.0, 0.0)));
    assert!(!state.energised(), "latched: no current by a command alone");
    assert_eq!(state.accepted_microsteps(), stood);
    let mut state = State::at_rest_energised(0);
    for i in 0..10 {
        step(&params, &mut state, 0, Some(&follow(f64::from(i * i) * 20.0, 0.0)));
    }
    let mut cycles = 0;
    while state.energised() {
        let motion = step(&params, &mut state, 0, Some(&StepCommand::default()));
        assert_eq!(motion.energised, motion.flags & validity::STANDSTILL == 0);
        cycles += 1;
    }
    assert!(cycles > 2, "it was in motion");
}

#[test]
fn a_missed_cycle_is_caught_up_without_a_trace() {
    let params = PARAMS;
    let mut state = State::at_rest_energised(0);
    let mut position = 0.0;
    for i in 0..200_u64 {
        let way = (i as f64 * 2.0).min(200.0);
        position += way;
        let command = follow(position, way);
        let motion = step(&params, &mut state, i, (i != 50).then_some(&command));
        assert_eq!(motion.flags & validity::COMMAND_MISSED != 0, i == 50);
        if i != 50 {
            assert_eq!(state.position_unrounded().0, position);
        }
    }
    assert_eq!(state.command_cycle(), 199);
}

#[test]
fn huge_counts_do_not_overflow() {
    let params = PARAMS;
    let limit = 9_007_199_254_740_992_i64;
    for start in [limit, -limit, i64::MAX, i64::MIN] {
        let mut state = State::at_rest_energised(start);
        for cycle in 0..100 {
            let target = if cycle % 2 == 0 { limit as f64 } else { -(limit as f64) };
            let motion = step(&params, &mut state, cycle, Some(&follow(target, 1e12)));
            assert!(motion.end.0.is_finite());
        }
        for cycle in 0..100 {
            step(&params, &mut state, cycle, None);
        }
    }
}

#[test]
fn parameters_that_no_drive_has_are_refused() {
    let good = PARAMS;
    assert_eq!(good.validate(), Ok(()));
    let bad = [
        Params { period_s: 0.0, ..good },
        Params { microstep_angle_rad: -1.0, ..good },
        Params { max_pulse_rate_hz: f64::NAN, ..good },
        Params { max_pulse_acceleration_hz_per_s: f64::INFINITY, ..good },
        Params { quick_stop_deceleration_hz_per_s: 1e-9, ..good },
        Params { silence_cycles: 0, ..good },
    ];
    for params in bad {
        let error = params.validate().unwrap_err();
        println!("{error}");
    }
}

/// The guard after its commands fell silent at `way` a cycle, with a neutral position; what it did in each cycle.
fn silent_with_neutral(neutral: i64, way_before: f64, cycles: usize) -> (State, Vec<(f64, u64)>) {
    let after_stop = AfterStop::Neutral { microsteps: neutral, pulse_rate_hz: 50e3, longest_way: 20_000.0 };
    let params = Params { after_stop, ..PARAMS };
    params.validate().unwrap();
    let mut state = State::at_rest_energised(0);
    let (mut position, mut last_way, mut cycle) = (0.0, 0.0, 0);
    while last_way < way_before {
        last_way += 40.0;
        position += last_way;
        step(&params, &mut state, cycle, Some(&follow(position, last_way)));
        cycle += 1;
    }
    let silent = (0..cycles).map(|n| {
        let motion = step(&params, &mut state, cycle + n as u64, None);
        (way(&motion), motion.flags)
    });
    let silent = silent.collect();
    (state, silent)
}

#[test]
fn after_silence_it_ramps_down_and_goes_to_the_neutral_position() {
    for neutral in [-5000, 0, 777, 6000] {
        let (mut state, cycles) = silent_with_neutral(neutral, 400.0, 1000);
        assert_eq!(state.accepted_microsteps(), neutral);
        let stood = cycles.iter().position(|(_, flags)| flags & validity::STANDSTILL != 0).unwrap();
        let bound = Params {
            after_stop: AfterStop::Neutral {
                microsteps: neutral,
                pulse_rate_hz: 50e3,
                longest_way: 20_000.0,
            },
            ..PARAMS
        };
        assert!((stood as u64) < stop_cycles_bound(&bound), "{stood} cycles");
        assert!(cycles[stood..].iter().all(|(way, flags)| *way == 0.0 && flags & validity::STANDSTILL != 0));
        // The silence, at the last rate; the ramp; then never faster than 50 kHz, and no jerk.
        assert_eq!(cycles[2].0, 400.0);
        assert!(cycles[8..].iter().all(|(way, _)| way.abs() <= 50.0 + 1e-6), "{:?}", &cycles[..20]);
        for pair in cycles.windows(2) {
            assert!((pair[1].0 - pair[0].0).abs() <= 100.0 + 1e-6, "{pair:?}");
        }
        assert!(cycles.iter().skip(3).all(|(_, flags)| flags & validity::ENERGISED != 0));
        // Nothing but a command that does not want to be followed takes the latch off.
        let found = step(&bound, &mut state, 5000, Some(&follow(neutral as f64, 0.0)));
        assert_eq!(found.fault, FaultCode::CommandSilent);
        step(&bound, &mut state, 5001, Some(&hold()));
        assert_eq!(state.mode(), Mode::Released);
    }
}

#[test]
fn a_valve_that_is_not_armed_never_goes_to_the_neutral_position() {
    let after_stop = AfterStop::Neutral { microsteps: 900, pulse_rate_hz: 50e3, longest_way: 20_000.0 };
    let params = Params { after_stop, ..PARAMS };
    let mut state = State::at_rest_energised(0);
    for cycle in 0..20 {
        step(&params, &mut state, cycle, Some(&hold()));
    }
    for cycle in 20..200 {
        assert_eq!(step(&params, &mut state, cycle, None).end.0, 0.0);
    }
}

/// A drive that follows at a steady rate of 100 micro-steps a cycle.
fn turning(params: &Params) -> (State, f64) {
    let mut state = State::at_rest_energised(0);
    let mut position = 0.0;
    for i in 0..40 {
        let way = (20.0 * f64::from(i)).min(100.0);
        position += way;
        step(params, &mut state, 0, Some(&follow(position, way)));
    }
    assert_eq!((state.mode(), state.position_unrounded().0), (Mode::Following, position));
    (state, position)
}

#[test]
fn nothing_is_followed_from_elsewhere_than_where_the_drive_stands() {
    let params = PARAMS;
    for (by, followed) in [(40.9, true), (-40.9, true), (41.1, false), (-41.1, false)] {
        let mut state = State::at_rest_energised(1000);
        let output = step(&params, &mut state, 0, Some(&follow(1000.0 + by, by)));
        assert_eq!(state.mode() == Mode::Following, followed, "{by}");
        assert!(output.flags & validity::LIMITED != 0, "{by}: cut or refused, it shows");
        assert_eq!(output.end.0 != 1000.0, followed, "{by}");
    }
}

#[test]
fn nothing_is_followed_without_current_and_the_count_stays() {
    let params = Params { energise_cycles: 5, ..PARAMS };
    let mut state = State::at_rest(1000);
    for cycle in 0..5 {
        let output = step(&params, &mut state, cycle, Some(&follow(1000.0, 0.0)));
        assert!(!output.energised && state.mode() == Mode::Idle, "cycle {cycle}");
    }
    assert!(step(&params, &mut state, 5, Some(&follow(1000.0, 0.0))).energised);
    assert_eq!(state.mode(), Mode::Idle);
    step(&params, &mut state, 6, Some(&follow(1000.0, 0.0)));
    assert_eq!((state.mode(), state.accepted_microsteps()), (Mode::Following, 1000));
}

#[test]
fn a_command_that_leaps_counts_as_missing_and_stops_the_drive() {
    let params = PARAMS;
    // Three cycles' way at the highest rate, and two more for each cycle without a command.
    for (leap, refused) in [(1799.0, false), (1801.0, true), (-1799.0, false), (-1801.0, true)] {
        let (mut state, position) = turning(&params);
        let output = step(&params, &mut state, 0, Some(&follow(position + leap, 100.0)));
        assert_eq!(output.flags & validity::COMMAND_MISSED != 0, refused, "{leap}");
    }
    let (mut state, position) = turning(&params);
    for _ in 0..params.silence_cycles {
        assert_eq!(state.mode(), Mode::Following);
        step(&params, &mut state, 0, Some(&follow(position + 1e6, 100.0)));
    }
    let output = step(&params, &mut state, 0, Some(&follow(position + 1e6, 100.0)));
    assert_eq!((state.mode(), output.fault), (Mode::StoppedItself, FaultCode::CommandMismatch));
}

#[test]
fn beyond_the_limits_of_angle_a_homed_valve_is_stopped_on_its_way_out_alone() {
    let highest_angle_rad = Some(0.0);
    let params = Params { highest_angle_rad, ..PARAMS };
    let (state, position) = turning(&Params { highest_angle_rad: None, ..params });
    let run = |state: &State, homed: bool, encoder_rad: Option<f64>, way: f64| {
        let mut state = *state;
        let sensors = Sensors { encoder_rad, homed };
        let ahead = position + way;
        drive::step(&params, &mut state, 0, Some(&follow(ahead, way)), &sensors);
        drive::step(&params, &mut state, 0, Some(&follow(ahead + way, way)), &sensors).fault
    };
    assert_eq!(run(&state, true, None, 100.0), FaultCode::AngleLimit, "by its own count");
    assert_eq!(run(&state, true, Some(0.1), 100.0), FaultCode::AngleLimit, "by the encoder");
    assert_eq!(run(&state, true, Some(-0.1), 100.0), FaultCode::None, "the encoder knows better");
    assert_eq!(run(&state, false, Some(0.1), 100.0), FaultCode::None, "not homed: no angle means anything");
    let back = State::at_rest_energised(position as i64);
    assert_eq!(run(&back, true, Some(0.1), -10.0), FaultCode::None, "on its way back");
}

#[test]
fn an_encoder_that_still_swings_is_no_standstill() {
    let params = PARAMS;
    let mut state = State::at_rest_energised(0);
    let mut still = |encoder_rad: f64| {
        let sensors = Sensors { encoder_rad: Some(encoder_rad), homed: true };
        let output = drive::step(&params, &mut state, 0, Some(&hold()), &sensors);
        output.flags & validity::STANDSTILL != 0
    };
    assert!(still(0.0), "it begins at rest");
    assert!(still(0.9e-4), "noise");
    assert!(!still(2e-4));
    assert!((0..4).all(|_| !still(2e-4)), "5 ms of rest are 5 cycles");
    assert!(still(2e-4));
}

#[test]
fn a_new_zero_shifts_the_count_once_at_rest_and_leaves_the_phase() {
    let params = PARAMS;
    let zero = |id: u64, follow: u64| StepCommand {
        zero_id: id,
        zero_shift_microsteps: 500,
        follow,
        follow_id: follow,
        position_unrounded: 1000.0,
        position_microsteps: 1000,
        ..hold()
    };
    let mut state = State::at_rest_energised(1000);
    step(&params, &mut state, 0, Some(&zero(1, 1)));
    assert_eq!((state.zero_id(), state.accepted_microsteps()), (0, 1000), "not while it follows");
    for _ in 0..3 {
        let output = step(&params, &mut state, 0, Some(&zero(1, 0)));
        assert_eq!((output.start.0, output.end.0), (1500.0, 1500.0));
    }
    assert_eq!((state.zero_id(), state.rebased_microsteps()), (1, 500));
    step(&params, &mut state, 0, Some(&zero(0, 0)));
    assert_eq!(state.accepted_microsteps(), 1500, "an older zero");
    let (mut state, _) = turning(&params);
    step(&params, &mut state, 0, Some(&zero(1, 0)));
    assert_eq!(state.zero_id(), 0, "not in motion");
}

#[test]
fn it_begins_to_follow_once_under_each_arming() {
    let under = |id: u64| StepCommand { follow: u64::from(id != 0), follow_id: id, ..hold() };
    let params = PARAMS;
    for (ids, expected) in [
        (&[1][..], Mode::Following),
        (&[1, 0, 1], Mode::Idle),
        (&[1, 0, 2], Mode::Following),
        (&[1, 0, 2, 0, 1], Mode::Following),
        (&[2, 0, 2, 2], Mode::Idle),
        // All commands between two armings were lost.
        (&[1, 2], Mode::Following),
    ] {
        let mut state = State::at_rest_energised(0);
        for id in ids {
            step(&params, &mut state, 0, Some(&under(*id)));
        }
        assert_eq!(state.mode(), expected, "{ids:?}");
    }
    // Nor after a stop by itself.
    for (id, expected) in [(1, Mode::Released), (2, Mode::Following)] {
        let mut state = State::at_rest_energised(0);
        step(&params, &mut state, 0, Some(&under(1)));
        (0..=params.silence_cycles).for_each(|_| _ = step(&params, &mut state, 0, None));
        assert_eq!(state.mode(), Mode::StoppedItself);
        step(&params, &mut state, 0, Some(&under(0)));
        assert_eq!(state.mode(), Mode::Released);
        step(&params, &mut state, 0, Some(&under(id)));
        assert_eq!(state.mode(), expected, "{id}");
    }
    // A bus that was lost in between makes no difference.
    let mut state = State::at_rest_energised(0);
    for id in [1, 0] {
        step(&params, &mut state, 0, Some(&under(id)));
    }
    state.rebase(0, true);
    step(&params, &mut state, 0, Some(&under(1)));
    assert_eq!(state.mode(), Mode::Idle);
}

#[test]
fn a_command_that_contradicts_itself_counts_as_missing() {
    let params = PARAMS;
    let mut state = State::at_rest_energised(0);
    for command in [StepCommand { follow: 1, ..hold() }, StepCommand { follow_id: 1, ..hold() }] {
        let output = step(&params, &mut state, 0, Some(&command));
        assert!(output.flags & validity::COMMAND_MISSED != 0, "{command:?}");
        assert_eq!(state.mode(), Mode::Idle);
    }
    let (mut state, position) = turning(&params);
    let next = follow(position + 100.0, 100.0);
    for command in [StepCommand { follow: 0, ..next }, StepCommand { follow_id: 0, ..next }] {
        let mut state = state;
        let output = step(&params, &mut state, 0, Some(&command));
        assert_eq!((state.mode(), way(&output)), (Mode::Following, 100.0), "it goes on without");
    }
    step(&params, &mut state, 0, Some(&next));
    assert_eq!(state.mode(), Mode::Following);
}

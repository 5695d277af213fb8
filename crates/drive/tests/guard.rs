//! What the guard promises, whatever the commands: limits, settling, stopping, and the latch.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::PARAMS;
use drive::{
    AfterStop, Microsteps, MicrostepsPerCycle, Mode, Output, Params, Sensors, State, stop_cycles_bound,
};
use proptest::prelude::*;
use signals::{FaultCode, StepCommand, validity};

const PERIOD_S: f64 = PARAMS.period_s;

/// A cycle of a drive that has no encoder.
fn step(params: &Params, state: &mut State, cycle: u64, command: Option<&StepCommand>) -> Output {
    drive::step(params, state, cycle, command, &Sensors::default())
}

fn follow(position: f64, way: f64) -> StepCommand {
    StepCommand {
        position_microsteps: position.round() as i64,
        position_unrounded: position,
        pulse_rate_hz: way / PERIOD_S,
        follow: 1,
        energise: 1,
        ..StepCommand::default()
    }
}

fn hold() -> StepCommand {
    StepCommand { energise: 1, ..StepCommand::default() }
}

fn way(motion: &Output) -> f64 {
    motion.pulse_rate_hz * PERIOD_S
}

/// One cycle of a scenario for the guard.
#[derive(Debug, Clone)]
enum Event {
    /// A command that is this far from the last one.
    Move(f64),
    /// A command that goes on at the last one's rate, changed by this much.
    Ramp(f64),
    /// A command to stay where the drive stands.
    Stay,
    Missing,
    NotFollowing,
    WithoutCurrent,
}

fn events() -> impl Strategy<Value = Vec<(Event, usize)>> {
    let event = prop_oneof![
        4 => (-1e5..1e5_f64).prop_map(Event::Move),
        4 => (-900.0..900.0_f64).prop_map(Event::Move),
        4 => (-60.0..60.0_f64).prop_map(Event::Ramp),
        3 => Just(Event::Stay),
        2 => Just(Event::Missing),
        1 => Just(Event::NotFollowing),
        1 => Just(Event::WithoutCurrent),
    ];
    prop::collection::vec((event, 1..30_usize), 1..30)
}

/// Plays events and hands every cycle's mode before, motion and state after to `look`.
fn play(
    start: i64,
    events: &[(Event, usize)],
    mut look: impl FnMut(Mode, &Output, &State),
) -> (State, f64, u64) {
    let params = PARAMS;
    let mut state = State::at_rest_energised(start);
    let (mut position, mut last_way, mut cycle) = (start as f64, 0.0, 0);
    for (event, times) in events {
        for _ in 0..*times {
            let command = match event {
                Event::Move(by) => {
                    last_way = *by;
                    position += by;
                    Some(follow(position, *by))
                }
                Event::Ramp(by) => {
                    last_way += by;
                    position += last_way;
                    Some(follow(position, last_way))
                }
                Event::Stay => {
                    (position, last_way) = (state.position_unrounded().0, 0.0);
                    Some(follow(position, 0.0))
                }
                Event::Missing => None,
                Event::NotFollowing => Some(hold()),
                Event::WithoutCurrent => Some(StepCommand::default()),
            };
            let before = state.mode();
            let motion = step(&params, &mut state, cycle, command.as_ref());
            look(before, &motion, &state);
            cycle += 1;
        }
    }
    (state, position, cycle)
}

/// How far apart two numbers of this size must be to differ for sure.
fn rounding(position: f64) -> f64 {
    16.0 * f64::EPSILON * position.abs() + 1e-6
}

/// Goes to a constant target within the limits until it stands there; says how far beyond it went.
fn settle(start: f64, travel: f64, target: f64) -> f64 {
    let params = PARAMS;
    let (mut position, mut travel, mut beyond) = (Microsteps(start), MicrostepsPerCycle(travel), 0.0_f64);
    for _ in 0..200_000 {
        let side = (target - position.0).signum();
        let way = MicrostepsPerCycle::ZERO;
        let taken = drive::follow(&params, position, travel, Microsteps(target), way);
        (position, travel) = (taken.position, taken.way);
        beyond = beyond.max((position.0 - target) * side);
        if travel == MicrostepsPerCycle::ZERO {
            assert_eq!(position.0, target);
            assert!(!taken.limited());
            return beyond;
        }
    }
    panic!("never settles at {target}");
}

proptest! {
    #[test]
    fn limits_hold_whatever_is_asked(start in -1_000_000_000_000_i64..1_000_000_000_000, events in events()) {
        let params = PARAMS;
        let (mut last_way, mut last_position) = (0.0, start as f64);
        let mut last_end = start as f64;
        play(start, &events, |_, motion, state| {
            let change = way(motion) - last_way;
            let slack = rounding(last_position);
            let allowed = if state.mode() == Mode::Following {
                params.max_pulse_acceleration_hz_per_s
            } else {
                params.quick_stop_deceleration_hz_per_s
            } * PERIOD_S * PERIOD_S;
            assert!(way(motion).abs() <= 600.0 * (1.0 + 1e-9) + slack, "rate {}", motion.pulse_rate_hz);
            assert!(change.abs() <= allowed * (1.0 + 1e-9) + slack, "change {change}");
            // The position is the sum of the ways, and what the motor gets is that, rounded.
            assert!((state.position_unrounded().0 - last_position - way(motion)).abs() <= slack);
            assert!((state.accepted_microsteps() as f64 - state.position_unrounded().0).abs() <= 1.0);
            assert_eq!(motion.start.0, last_end);
            assert_eq!(motion.end.0, state.accepted_microsteps() as f64);
            assert!(motion.energised || way(motion) == 0.0, "moves without current");
            last_way = way(motion);
            last_position = state.position_unrounded().0;
            last_end = motion.end.0;
        });
    }

    #[test]
    fn a_constant_command_within_reach_is_reached(start in -1_000_000_000_i64..1_000_000_000, events in events(), last in -1500.0..1500.0_f64) {
        let (mut state, _, mut cycle) = play(start, &events, |_, _, _| {});
        // Whatever latch there is: let it stop, take it off, stand where the drive stands.
        let params = PARAMS;
        for _ in 0..stop_cycles_bound(&params) + 1 {
            step(&params, &mut state, cycle, Some(&hold()));
            cycle += 1;
        }
        let own = state.position_unrounded().0;
        for way in [0.0, last] {
            for _ in 0..200 {
                step(&params, &mut state, cycle, Some(&follow(own + way, 0.0)));
                cycle += 1;
            }
        }
        prop_assert_eq!(state.mode(), Mode::Following);
        prop_assert_eq!(state.position_unrounded().0, own + last);
    }

    #[test]
    fn catching_up_ends_on_the_target(start in -1e6..1e6_f64, travel in -600.0..600.0_f64, by in -1e6..1e6_f64) {
        settle(start, travel, start + by);
    }

    #[test]
    fn catching_up_from_rest_never_passes_the_target(start in -1e6..1e6_f64, by in -1e6..1e6_f64) {
        let beyond = settle(start, 0.0, start + by);
        prop_assert!(beyond <= 1e-6, "went {beyond} micro-steps beyond");
    }

    #[test]
    fn catching_up_with_a_steady_rotation_never_passes_it(behind in -1e5..1e5_f64, rate in -500.0..500.0_f64) {
        let params = PARAMS;
        let (mut position, mut travel) = (Microsteps(0.0), MicrostepsPerCycle::ZERO);
        let mut caught_up = 0;
        for cycle in 0..20_000_u64 {
            let target = behind + rate * (cycle + 1) as f64;
            let own_way = MicrostepsPerCycle(rate);
            let taken = drive::follow(&params, position, travel, Microsteps(target), own_way);
            (position, travel) = (taken.position, taken.way);
            let gap = target - position.0;
            // Where the command comes towards the drive it can pass before the drive is up to its rate.
            if behind * rate >= 0.0 {
                prop_assert!(gap * behind.signum() >= -1e-6, "went {} beyond", -gap);
            }
            caught_up = if gap.abs() < 1e-6 { caught_up + 1 } else { 0 };
        }
        prop_assert!(caught_up > 100, "still behind");
    }

    #[test]
    fn a_command_within_the_limits_passes_untouched(start in -1_000_000_000_000_i64..1_000_000_000_000,
        ramps in prop::collection::vec((-1.0..1.0_f64, 1..40_usize), 1..40)) {
        let params = PARAMS;
        let mut state = State::at_rest_energised(start);
        let (mut position, mut last, mut cycle) = (start as f64, 0.0_f64, 0);
        for (share, times) in ramps {
            for _ in 0..times {
                // The very limits, most of the time.
                let change = (share * 4.0).clamp(-1.0, 1.0) * 40.0;
                last = (last + change).clamp(-600.0, 600.0);
                position += last;
                let command = follow(position, last);
                let motion = step(&params, &mut state, cycle, Some(&command));
                cycle += 1;
                prop_assert_eq!(motion.flags & validity::LIMITED, 0);
                prop_assert_eq!(state.position_unrounded().0, position);
                prop_assert_eq!(motion.end.0, command.position_microsteps as f64);
            }
        }
    }

    #[test]
    fn silence_stops_the_valve_within_the_bound_and_latches(events in events(), silence in 1..60_u64,
        stop in 1e6..1e9_f64) {
        let params = Params { silence_cycles: silence, quick_stop_deceleration_hz_per_s: stop, ..PARAMS };
        let (mut state, _, mut cycle) = play(0, &events, |_, _, _| {});
        // Commands that end, after a fresh start from wherever the events led to.
        for _ in 0..stop_cycles_bound(&params) {
            step(&params, &mut state, cycle, Some(&hold()));
            cycle += 1;
        }
        let mut position = state.position_unrounded().0;
        for i in 0..30 {
            position += 10.0 * f64::from(i);
            step(&params, &mut state, cycle, Some(&follow(position, 10.0 * f64::from(i))));
            cycle += 1;
        }
        prop_assert_eq!(state.mode(), Mode::Following);
        let mut silent = Vec::new();
        for _ in 0..stop_cycles_bound(&params) {
            silent.push(step(&params, &mut state, cycle, None));
            cycle += 1;
        }
        for (i, motion) in silent.iter().enumerate().take(silence as usize) {
            prop_assert!((way(motion) - 290.0).abs() < 1e-6, "cycle {} does not go on at the last rate", i);
            prop_assert!(motion.flags & validity::COMMAND_MISSED != 0);
        }
        if let Some(first) = silent.get(silence as usize) {
            prop_assert!(way(first).abs() < 290.0, "the ramp begins late");
        }
        let last = silent.last().unwrap();
        prop_assert_eq!(way(last), 0.0);
        prop_assert_eq!(last.fault, FaultCode::CommandSilent);
        prop_assert!(last.flags & (validity::STANDSTILL | validity::STOPPED_ITSELF) == validity::STANDSTILL | validity::STOPPED_ITSELF);
        // Latched: a command alone does not move it.
        let stood = state.accepted_microsteps();
        for _ in 0..50 {
            step(&params, &mut state, cycle, Some(&follow(stood as f64 + 500.0, 0.0)));
            cycle += 1;
        }
        prop_assert_eq!(state.accepted_microsteps(), stood);
        prop_assert_eq!(state.mode(), Mode::StoppedItself);
    }

    #[test]
    fn nothing_moves_before_the_first_follow(start in any::<i64>(), commands in prop::collection::vec(0..3_u8, 1..200)) {
        let params = PARAMS;
        let start = start / 4096;
        let mut state = State::at_rest(start);
        for (cycle, kind) in commands.into_iter().enumerate() {
            let command = match kind {
                0 => None,
                1 => Some(hold()),
                _ => Some(StepCommand { position_microsteps: 77, position_unrounded: 77.0, pulse_rate_hz: 1e5, ..hold() }),
            };
            let motion = step(&params, &mut state, cycle as u64, command.as_ref());
            prop_assert_eq!((motion.start.0, motion.end.0), (start as f64, start as f64));
            prop_assert_eq!(motion.fault, FaultCode::None);
            prop_assert!(motion.flags & validity::STANDSTILL != 0);
        }
    }
}

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
    let motion = step(&params, &mut state, cycle + 1, Some(&follow(stood as f64 + 5.0, 0.0)));
    assert_eq!((state.mode(), state.accepted_microsteps()), (Mode::Released, stood));
    assert!(motion.flags & validity::LIMITED != 0, "a command that is not followed must show");
    step(&params, &mut state, cycle + 2, Some(&follow(stood as f64, 0.0)));
    assert_eq!(state.mode(), Mode::Following);
    step(&params, &mut state, cycle + 3, Some(&follow(stood as f64 + 5.0, 5.0)));
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

//! What the guard promises, whatever the commands: limits, settling, stopping, and the latch.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use drive::{AfterStop, Mode, Output, Params, State, step, stop_cycles_bound};
use proptest::prelude::*;
use signals::{FaultCode, StepCommand, validity};

const PERIOD_S: f64 = 1e-3;

/// At most 600 micro-steps a cycle, 40 more or less each cycle, 100 less in a quick stop.
fn params() -> Params {
    Params {
        period_s: PERIOD_S,
        microstep_angle_rad: 5.585e-5,
        max_pulse_rate_hz: 600e3,
        max_pulse_acceleration_hz_per_s: 40e6,
        quick_stop_deceleration_hz_per_s: 100e6,
        after_stop: AfterStop::Hold,
        silence_cycles: 3,
    }
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
    Missing,
    NotFollowing,
    WithoutCurrent,
}

fn events() -> impl Strategy<Value = Vec<(Event, usize)>> {
    let event = prop_oneof![
        4 => (-1e5..1e5_f64).prop_map(Event::Move),
        4 => (-900.0..900.0_f64).prop_map(Event::Move),
        4 => (-60.0..60.0_f64).prop_map(Event::Ramp),
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
    let params = params();
    let mut state = State::at_rest(start);
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

/// Runs the guard with one constant command until it stands there; says how far beyond it went.
fn settle(state: &mut State, target: f64, cycle: &mut u64) -> f64 {
    let params = params();
    let (mut beyond, mut quiet) = (0.0_f64, 0);
    for _ in 0..200_000 {
        let side = (target - state.position_unrounded().0).signum();
        let motion = step(&params, state, *cycle, Some(&follow(target, 0.0)));
        *cycle += 1;
        beyond = beyond.max((state.position_unrounded().0 - target) * side);
        quiet = if motion.flags & validity::STANDSTILL != 0 { quiet + 1 } else { 0 };
        if quiet == 3 {
            assert_eq!(state.position_unrounded().0, target);
            assert_eq!(motion.flags & validity::LIMITED, 0);
            return beyond;
        }
    }
    panic!("never settles at {target}: {state:?}");
}

proptest! {
    #[test]
    fn limits_hold_whatever_is_asked(start in -1_000_000_000_000_i64..1_000_000_000_000, events in events()) {
        let params = params();
        let (mut last_way, mut last_position) = (0.0, start as f64);
        let (mut last_end, mut had_current) = (start as f64, false);
        play(start, &events, |_, motion, state| {
            if !had_current {
                // Nothing holds the rotor: energising may begin the count anew.
                last_end = motion.start_microsteps;
                last_position = state.position_unrounded().0 - way(motion);
            }
            had_current = motion.energised;
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
            assert_eq!(motion.start_microsteps, last_end);
            assert_eq!(motion.end_microsteps, state.accepted_microsteps() as f64);
            assert!(motion.energised || way(motion) == 0.0, "moves without current");
            last_way = way(motion);
            last_position = state.position_unrounded().0;
            last_end = motion.end_microsteps;
        });
    }

    #[test]
    fn a_constant_command_is_reached(start in -1_000_000_000_i64..1_000_000_000, events in events(), last in -1e5..1e5_f64) {
        let (mut state, position, mut cycle) = play(start, &events, |_, _, _| {});
        // Whatever latch there is: let it stop, take it off, stand where the drive stands.
        let params = params();
        for _ in 0..stop_cycles_bound(&params) + 1 {
            step(&params, &mut state, cycle, Some(&hold()));
            cycle += 1;
        }
        let own = state.position_unrounded().0;
        step(&params, &mut state, cycle, Some(&follow(own, 0.0)));
        cycle += 1;
        settle(&mut state, position + last, &mut cycle);
    }

    #[test]
    fn catching_up_from_rest_never_passes_the_target(start in -1_000_000_i64..1_000_000, by in -1e6..1e6_f64) {
        let mut state = State::at_rest(start);
        let beyond = settle(&mut state, start as f64 + by, &mut 0);
        prop_assert!(beyond <= 1e-6, "went {beyond} micro-steps beyond");
    }

    #[test]
    fn catching_up_with_a_steady_rotation_never_passes_it(behind in -1e5..1e5_f64, rate in -500.0..500.0_f64) {
        let params = params();
        let mut state = State::at_rest(0);
        let mut caught_up = 0;
        for cycle in 0..20_000_u64 {
            let target = behind + rate * (cycle + 1) as f64;
            step(&params, &mut state, cycle, Some(&follow(target, rate)));
            let gap = target - state.position_unrounded().0;
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
        let params = params();
        let mut state = State::at_rest(start);
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
                prop_assert_eq!(motion.end_microsteps, command.position_microsteps as f64);
            }
        }
    }

    #[test]
    fn silence_stops_the_valve_within_the_bound_and_latches(events in events(), silence in 1..60_u64,
        stop in 1e6..1e9_f64) {
        let params = Params { silence_cycles: silence, quick_stop_deceleration_hz_per_s: stop, ..params() };
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
        let params = params();
        let start = start / 4096;
        let mut state = State::at_rest(start);
        for (cycle, kind) in commands.into_iter().enumerate() {
            let command = match kind {
                0 => None,
                1 => Some(hold()),
                _ => Some(StepCommand { position_microsteps: 77, position_unrounded: 77.0, pulse_rate_hz: 1e5, ..hold() }),
            };
            let motion = step(&params, &mut state, cycle as u64, command.as_ref());
            prop_assert_eq!((motion.start_microsteps, motion.end_microsteps), (start as f64, start as f64));
            prop_assert_eq!(motion.fault, FaultCode::None);
            prop_assert!(motion.flags & validity::STANDSTILL != 0);
        }
    }
}

/// A drive that has been stopped by silence from a rotation.
fn stopped(params: &Params) -> (State, u64) {
    let mut state = State::at_rest(1000);
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
    let params = params();
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
    let params = params();
    let mut state = State::at_rest(0);
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
    let params = Params { after_stop: AfterStop::DeEnergise, ..params() };
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
    let params = params();
    let mut state = State::at_rest(0);
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
    let params = params();
    let limit = 9_007_199_254_740_992_i64;
    for start in [limit, -limit, i64::MAX, i64::MIN] {
        let mut state = State::at_rest(start);
        for cycle in 0..100 {
            let target = if cycle % 2 == 0 { limit as f64 } else { -(limit as f64) };
            let motion = step(&params, &mut state, cycle, Some(&follow(target, 1e12)));
            assert!(motion.end_microsteps.is_finite());
        }
        for cycle in 0..100 {
            step(&params, &mut state, cycle, None);
        }
    }
}

#[test]
fn parameters_that_no_drive_has_are_refused() {
    let good = params();
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
    let params = Params { after_stop, ..params() };
    params.validate().unwrap();
    let mut state = State::at_rest(0);
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
            ..params()
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
    let params = Params { after_stop, ..params() };
    let mut state = State::at_rest_energised(0);
    for cycle in 0..20 {
        step(&params, &mut state, cycle, Some(&hold()));
    }
    for cycle in 20..200 {
        assert_eq!(step(&params, &mut state, cycle, None).end_microsteps, 0.0);
    }
}

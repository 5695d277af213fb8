//! What the guard promises, whatever the commands: limits, settling, stopping, and the latch.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::{PARAMS, PERIOD_S, follow, follow_anew, hold, step, way};
use drive::{Microsteps, MicrostepsPerCycle, Mode, Output, Params, State, stop_cycles_bound};
use proptest::prelude::*;
use signals::{FaultCode, StepCommand, validity};

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
    // As a controller counts: each time that it asks to be followed again is another arming.
    let (mut armings, mut asks) = (0, false);
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
            let command = command.map(|command| {
                let follows = command.follow == 1;
                armings += u64::from(follows && !asks);
                asks = follows;
                StepCommand { follow_id: if follows { armings } else { 0 }, ..command }
            });
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
                step(&params, &mut state, cycle, Some(&follow_anew(own + way, 0.0)));
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
            step(&params, &mut state, cycle, Some(&follow_anew(position, 10.0 * f64::from(i))));
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

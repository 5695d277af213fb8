//! Each condition, mode and state of the trigger, in tables.

use super::*;
use proptest::prelude::*;

fn settings(condition: Condition) -> Settings {
    Settings {
        signal: "x".to_owned(),
        condition,
        mode: Mode::Normal,
        pre_cycles: 2,
        post_cycles: 2,
        delay_cycles: 0,
        hold_off_cycles: 0,
    }
}

/// The triggers of a signal that has one value a cycle, from cycle 0.
fn triggers(settings: &Settings, values: &[f64]) -> Vec<u64> {
    windows(settings, values).iter().filter_map(|window| window.trigger).collect()
}

fn windows(settings: &Settings, values: &[f64]) -> Vec<Window> {
    let mut machine = Machine::new(settings.clone(), None);
    (0..).zip(values).filter_map(|(cycle, value)| machine.step(cycle, *value)).collect()
}

const fn edge(slope: Slope, hysteresis: f64) -> Condition {
    Condition::Edge { level: 1.0, slope, hysteresis }
}

#[test]
fn every_condition_is_met_where_it_should_be() {
    use Slope::{Either, Falling, Rising};
    // With 2 cycles before and behind, the first trigger can be at 2, and the next 3 later.
    let wave = [0., 0., 0., 2., 2., 2., 2., 0., 0., 0., 0., 2., 2., 2., 2.];
    let noisy = [0., 0., 0., 1.0, 0.9, 1.1, 0.8, 1.1, 0.9, 1.1, 0.2, 1.1, 1.1, 1.1];
    let states = [1., 1., 1., 3., 3., 3., 3., 0., 0., 0., 0., 5., 5., 5.];
    let table: &[(&str, Condition, &[f64], &[u64])] = &[
        ("rising", edge(Rising, 0.0), &wave, &[3, 11]),
        ("falling", edge(Falling, 0.0), &wave, &[7]),
        ("either", edge(Either, 0.0), &wave, &[3, 7, 11]),
        ("noise is an edge without hysteresis", edge(Rising, 0.0), &noisy, &[3, 7, 11]),
        ("and none with it", edge(Rising, 0.5), &noisy, &[3, 11]),
        ("an edge needs the other side first", edge(Rising, 0.0), &[2.; 8], &[]),
        ("the level itself is reached", edge(Rising, 0.0), &[0., 0., 0., 1., 1., 1.], &[3]),
        ("above", Condition::Level { level: 1.0, above: true }, &wave, &[3, 6, 11]),
        ("below", Condition::Level { level: 1.0, above: false }, &wave, &[2, 7, 10]),
        ("into a window", Condition::Window { low: 1.0, high: 3.0, inside: true }, &wave, &[3, 11]),
        ("out of a window", Condition::Window { low: 1.0, high: 3.0, inside: false }, &wave, &[7]),
        ("another state", Condition::Change, &states, &[3, 7, 11]),
        ("a fault", Condition::Raised, &states, &[11]),
        ("a fault that is there at first is old", Condition::Raised, &[4.; 8], &[]),
        ("no number meets nothing", edge(Either, 0.0), &[0., 0., f64::NAN, f64::NAN, 0., 0.], &[]),
    ];
    for (what, condition, values, expected) in table {
        assert_eq!(triggers(&settings(*condition), values), *expected, "{what}");
    }
}

#[test]
fn modes_say_what_follows_a_capture() {
    let wave: Vec<f64> = (0..40).map(|cycle| f64::from(cycle / 5 % 2 * 2)).collect();
    let of = |mode| Settings { mode, ..settings(edge(Slope::Rising, 0.0)) };
    assert_eq!(triggers(&of(Mode::Normal), &wave), [5, 15, 25, 35]);
    assert_eq!(triggers(&of(Mode::Single), &wave), [5]);
    // Nothing happens: auto takes a capture all the same, which has no trigger.
    let still = windows(&of(Mode::Auto), &[0.0; 20]);
    assert!(still.len() >= 2 && still.iter().all(|window| window.trigger.is_none()), "{still:?}");
    assert!(windows(&of(Mode::Normal), &[0.0; 20]).is_empty());
}

#[test]
fn windows_hold_what_was_asked_for() {
    let step: Vec<f64> = (0..100).map(|cycle| f64::from(u8::from(cycle >= 30))).collect();
    let of = |pre_cycles, post_cycles, delay_cycles| Settings {
        pre_cycles,
        post_cycles,
        delay_cycles,
        mode: Mode::Single,
        ..settings(edge(Slope::Rising, 0.0))
    };
    let table = [
        (of(10, 5, 0), Some((30, 20, 35))),
        (of(0, 1, 0), Some((30, 30, 31))),
        // The window lies behind the trigger: no past is wanted.
        (of(10, 5, 40), Some((70, 60, 75))),
        // The past is too short when the edge comes, and there is no other edge.
        (of(31, 5, 0), None),
        (of(30, 5, 0), Some((30, 0, 35))),
    ];
    for (settings, expected) in table {
        let found = windows(&settings, &step);
        let found = found.first().map(|window| (window.zero, window.from, window.to));
        assert_eq!(found, expected, "{settings:?}");
    }
}

#[test]
fn nothing_is_seen_during_hold_off() {
    let wave: Vec<f64> = (0..100).map(|cycle| f64::from(cycle / 5 % 2)).collect();
    let condition = Condition::Edge { level: 0.5, slope: Slope::Rising, hysteresis: 0.0 };
    let held = Settings { hold_off_cycles: 25, ..settings(condition) };
    assert_eq!(triggers(&held, &wave), [5, 35, 65, 95]);
}

#[test]
fn a_restart_ends_what_was_under_way() {
    let mut machine = Machine::new(Settings { post_cycles: 50, ..settings(Condition::Change) }, None);
    (0..10).for_each(|cycle| assert_eq!(machine.step(cycle, 0.0), None));
    assert_eq!(machine.step(10, 1.0), None);
    let cut = machine.restart(20).unwrap();
    assert_eq!((cut.trigger, cut.from, cut.to), (Some(10), 8, 20));
    assert_eq!(machine.state(), State::Filling);
    // The first value of the new generation is no change.
    assert_eq!(machine.step(0, 0.0), None);
    assert_eq!(machine.state(), State::Filling);
    assert_eq!(machine.restart(5), None);
}

#[test]
fn it_is_armed_and_forced_by_hand() {
    let mut machine = Machine::new(Settings { mode: Mode::Single, ..settings(Condition::Change) }, None);
    (0..5).for_each(|cycle| assert_eq!(machine.step(cycle, 0.0), None));
    machine.force(5);
    let taken = (5..8).find_map(|cycle| machine.step(cycle, 0.0)).unwrap();
    assert_eq!((taken.trigger, taken.from, taken.to), (None, 3, 7));
    assert_eq!(machine.state(), State::Stopped);
    assert_eq!(machine.step(8, 1.0), None, "stopped");
    machine.arm();
    assert_eq!(machine.step(9, 1.0), None);
    assert_eq!(machine.state(), State::Armed { since: 9 });
}

#[test]
fn impossible_settings_are_refused() {
    let with = |condition| settings(condition);
    let table = [
        (Settings { pre_cycles: 900, post_cycles: 200, ..with(Condition::Change) }, "1100 cycles"),
        (Settings { post_cycles: 0, ..with(Condition::Change) }, "at least 1"),
        (with(Condition::Level { level: f64::NAN, above: true }), "no number"),
        (with(Condition::Window { low: 2.0, high: 1.0, inside: true }), "lower bound"),
        (with(Condition::Edge { level: 0.0, slope: Slope::Either, hysteresis: -1.0 }), "negative"),
    ];
    for (settings, expected) in table {
        let said = settings.check(1000).unwrap_err().to_string();
        assert!(said.contains(expected), "{said}");
    }
    assert_eq!(with(Condition::Change).check(4), Ok(()));
}

proptest! {
    /// Whatever the signal does and however many cycles are skipped: windows are as long as asked for, and in order.
    #[test]
    fn windows_are_exact(
        pre_cycles in 0u64..50, post_cycles in 1u64..50, delay_cycles in 0u64..80, hold_off_cycles in 0u64..200,
        samples in prop::collection::vec((1u64..4, -2.0f64..2.0), 1..600),
    ) {
        let settings = Settings {
            pre_cycles, post_cycles, delay_cycles, hold_off_cycles,
            ..settings(edge(Slope::Either, 0.0))
        };
        let mut machine = Machine::new(settings, None);
        let (mut cycle, mut last) = (0, None);
        for (skipped, value) in samples {
            cycle += skipped;
            if let Some(window) = machine.step(cycle, value) {
                let trigger = window.trigger.unwrap();
                prop_assert_eq!(window.zero, trigger + delay_cycles);
                prop_assert_eq!(window.from, window.zero - pre_cycles);
                prop_assert_eq!(window.to, window.zero + post_cycles);
                if let Some(last) = last {
                    prop_assert!(trigger > last && trigger - last >= hold_off_cycles);
                }
                last = Some(trigger);
            }
        }
    }
}

//! The oracle finds each kind of unsafe pulse, and nothing in a good run.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use oracle::{Judge, Limits, Order, Unsafe, Wish};
use signals::{PlantTruth, StepCommand};

/// At most 600 pulses a cycle, 40 more each cycle, 100 less in a quick stop.
const LIMITS: Limits = Limits {
    period_s: 1e-3,
    max_pulse_rate_hz: 600e3,
    max_pulse_acceleration_hz_per_s: 40e6,
    quick_stop_deceleration_hz_per_s: 100e6,
    silence_cycles: 3,
    command_delay_cycles: 0,
    arming_cycles: 0,
    neutral_pulse_rate_hz: 0.0,
};

fn truth(pulses: i64) -> PlantTruth {
    let halves = 2 * pulses.unsigned_abs();
    let at = |half: u64| (1_000_000 * half).checked_div(halves).unwrap_or(0);
    PlantTruth {
        pulses,
        first_pulse_ns: at(1),
        last_pulse_ns: at(halves.saturating_sub(1)),
        ..PlantTruth::default()
    }
}

/// An order that holds in its own cycle alone.
fn order(wish: Wish, cycle: u64) -> Order {
    Order { wish, from_cycle: cycle, until_cycle: cycle }
}

/// A run: pulses of each cycle, and whether a command to follow was there; armed in cycle 0.
fn findings(run: &[(i64, Option<bool>)]) -> Vec<Unsafe> {
    findings_under(&[order(Wish::Move, 0)], run)
}

/// The same under these orders.
fn findings_under(orders: &[Order], run: &[(i64, Option<bool>)]) -> Vec<Unsafe> {
    let mut judge = Judge::new(LIMITS);
    orders.iter().for_each(|order| judge.order(*order));
    let (mut armings, mut follows) = (0, false);
    for (cycle, (pulses, follow)) in run.iter().enumerate() {
        judge.truth(cycle as u64 + 1, &truth(*pulses));
        if let Some(follow) = *follow {
            armings += u64::from(follow && !follows);
            follows = follow;
            judge.command(cycle as u64, &command(if follow { armings } else { 0 }));
        }
    }
    judge.verdict().findings
}

/// A command under the arming of this number; 0 for one that asks for no motion.
fn command(id: u64) -> StepCommand {
    StepCommand { follow: u64::from(id != 0), follow_id: id, energise: 1, ..StepCommand::default() }
}

fn ramp_up() -> Vec<(i64, Option<bool>)> {
    [(0, Some(false)), (40, Some(true)), (80, Some(true)), (120, Some(true)), (120, Some(true))].to_vec()
}

#[test]
fn a_good_run_ends_in_silence() {
    let silence = [120, 120, 120, 20, 0, 0, 0].map(|pulses| (pulses, None));
    assert_eq!(findings(&[&ramp_up()[..], &silence].concat()), []);
}

#[test]
fn one_cycle_too_long_is_found() {
    let silence = [120, 120, 120, 120, 120, 120, 20, 0].map(|pulses| (pulses, None));
    let found = findings(&[&ramp_up()[..], &silence].concat());
    assert!(matches!(found[..], [Unsafe::AfterDeadline { cycle: 10, .. }, ..]), "{found:?}");
}

#[test]
fn a_stop_that_was_ordered_has_no_silence_to_wait_for() {
    let good = [(20, Some(false)), (0, Some(false)), (0, Some(false))];
    assert_eq!(findings(&[&ramp_up()[..], &good].concat()), []);
    let late = [(120, Some(false)); 5];
    let found = findings(&[&ramp_up()[..], &late].concat());
    assert!(matches!(found[..], [Unsafe::AfterDeadline { .. }, ..]), "{found:?}");
}

#[test]
fn pulses_before_arming_are_found() {
    assert_eq!(findings(&[(0, None), (1, Some(false))]), [Unsafe::BeforeArming { cycle: 1 }]);
}

#[test]
fn rate_and_acceleration_are_checked() {
    let follow = |pulses: i64| (pulses, Some(true));
    assert_eq!(
        findings(&[follow(0), follow(43)]),
        [Unsafe::Acceleration { cycle: 1, before: 0, pulses: 43 }]
    );
    assert_eq!(
        findings(&[follow(30), follow(-13)]),
        [Unsafe::Acceleration { cycle: 1, before: 30, pulses: -13 }]
    );
    assert_eq!(findings(&[follow(300), follow(198)]), []);
    assert_eq!(findings(&[follow(602)]).len(), 1);
}

#[test]
fn impossible_times_are_found() {
    let mut judge = Judge::new(LIMITS);
    judge.order(order(Wish::Move, 0));
    judge.command(0, &command(1));
    judge.truth(1, &PlantTruth { first_pulse_ns: 10, last_pulse_ns: 300_000, ..truth(600) });
    judge.truth(3, &PlantTruth { last_pulse_ns: 5, ..truth(0) });
    let found = judge.verdict().findings;
    assert_eq!(found, [Unsafe::Rate { cycle: 0, pulses: 600 }, Unsafe::Time { cycle: 2 }]);
}

#[test]
fn nothing_follows_without_an_order() {
    let run = [&ramp_up()[..], &[(20, Some(true)), (0, Some(false))]].concat();
    assert_eq!(findings_under(&[order(Wish::Move, 0)], &run), []);
    for orders in [&[][..], &[order(Wish::Move, 2)], &[order(Wish::Stop, 0)]] {
        let found = findings_under(orders, &run);
        assert_eq!(found.first(), Some(&Unsafe::WithoutOrder { cycle: 1 }), "{orders:?}: {found:?}");
    }
    // One order arms once: what follows later again needs another.
    let again = [&run[..], &[(0, Some(false)), (40, Some(true)), (0, Some(true)), (0, Some(false))]].concat();
    let found = findings_under(&[order(Wish::Move, 0)], &again);
    assert_eq!(found, [Unsafe::WithoutOrder { cycle: 8 }]);
    assert_eq!(findings_under(&[order(Wish::Move, 0), order(Wish::Move, 7)], &again), []);
}

/// Commands and pulses of each cycle, under one order in cycle 0.
fn findings_of(run: &[(i64, StepCommand)]) -> Vec<Unsafe> {
    let mut judge = Judge::new(LIMITS);
    judge.order(order(Wish::Move, 0));
    for (cycle, (pulses, command)) in run.iter().enumerate() {
        judge.truth(cycle as u64 + 1, &truth(*pulses));
        judge.command(cycle as u64, command);
    }
    judge.verdict().findings
}

#[test]
fn an_arming_that_has_ended_allows_no_pulse() {
    let ended = [(0, command(0)), (40, command(1)), (0, command(0)), (0, command(0))];
    assert_eq!(findings_of(&[&ended[..], &[(0, command(1)); 9]].concat()), []);
    let found = findings_of(&[&ended[..], &[(30, command(1)); 9]].concat());
    assert!(matches!(found[..], [Unsafe::AfterDeadline { .. }, ..]), "{found:?}");
}

#[test]
fn a_command_that_contradicts_itself_is_none() {
    let altered = StepCommand { follow: 1, ..command(0) };
    let run = [(0, altered), (40, command(1)), (0, command(0))];
    assert_eq!(findings_of(&run), []);
    let found = findings_of(&[(0, command(0)), (5, altered)]);
    assert_eq!(found, [Unsafe::BeforeArming { cycle: 1 }]);
}

#[test]
fn pulses_after_a_disarm_are_found() {
    let on = [&ramp_up()[..], &[(120, Some(true)); 30], &[(20, Some(true)), (0, Some(false))]].concat();
    let found = findings_under(&[order(Wish::Move, 0), order(Wish::Stop, 3)], &on);
    assert!(matches!(found.first(), Some(Unsafe::AfterDisarm { given: 3, .. })), "{found:?}");
    assert_eq!(findings_under(&[order(Wish::Move, 0), order(Wish::Stop, 33)], &on), []);
}

//! What holds of every reference, whatever the set-points: limits, continuity, arrival.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::{PERIOD_S, Rig, set_point, sine};
use proptest::prelude::*;
use signals::{Reference, SetPoint, SetPointKind, SetPointRefusal};
use trajectory::Limits;

/// A set-point with numbers as shares of what the limits allow, and how many cycles it is given.
#[derive(Debug, Clone)]
struct Event {
    kind: SetPointKind,
    value: f64,
    frequency: f64,
    given: bool,
    pressure_pa: f64,
    cycles: usize,
}

fn events() -> impl Strategy<Value = Vec<Event>> {
    let kind = prop_oneof![
        4 => Just(SetPointKind::Angle),
        1 => Just(SetPointKind::Opening),
        2 => Just(SetPointKind::Flow),
        2 => Just(SetPointKind::Speed),
        2 => Just(SetPointKind::Sine),
        1 => Just(SetPointKind::Hold),
    ];
    let cycles = prop_oneof![3 => 1..30_usize, 2 => 30..400_usize];
    let event = (kind, -1.05..1.05_f64, 0.0..1.0_f64, any::<bool>(), 1e4..2e7_f64, cycles);
    let event = event.prop_map(|(kind, value, frequency, given, pressure_pa, cycles)| Event {
        kind,
        value,
        frequency,
        given,
        pressure_pa,
        cycles,
    });
    prop::collection::vec(event, 1..15)
}

/// From slow and soft to fast and hard, position limits or none.
fn limits() -> impl Strategy<Value = Limits> {
    let decades = (-1.0..2.0_f64, 0.0..4.0_f64, 1.0..7.0_f64);
    (decades, any::<bool>(), 0.05..3.0_f64, 0.05..3.0_f64).prop_map(|((v, a, j), bounded, low, high)| {
        Limits {
            min_angle_rad: bounded.then_some(-low),
            max_angle_rad: bounded.then_some(high),
            max_speed_rad_per_s: 10_f64.powf(v),
            max_acceleration_rad_per_s2: 10_f64.powf(a),
            max_jerk_rad_per_s3: 10_f64.powf(j),
            unhomed_speed_rad_per_s: 0.2,
        }
    })
}

fn wish(event: &Event, id: u64, limits: &Limits) -> SetPoint {
    let reach = if event.value < 0.0 { limits.min_angle_rad } else { limits.max_angle_rad };
    let value = match event.kind {
        SetPointKind::Angle => event.value * reach.map_or(2.0, f64::abs),
        SetPointKind::Opening => event.value.abs(),
        SetPointKind::Flow => event.value.abs() * 1e-3,
        SetPointKind::Speed => event.value * limits.max_speed_rad_per_s,
        SetPointKind::Sine => event.value * 0.3,
        SetPointKind::Hold => 0.0,
    };
    SetPoint {
        frequency_hz: if event.kind == SetPointKind::Sine {
            0.05 + 20.0 * event.frequency.powi(4)
        } else {
            0.0
        },
        pressure_given: u64::from(event.given),
        pressure_drop_pa: event.pressure_pa,
        ..set_point(id, event.kind, value)
    }
}

/// Plays the events; hands each pair of neighbouring references to `look`.
fn play(rig: &mut Rig, events: &[Event], mut look: impl FnMut(&Rig, &Reference, &Reference)) {
    let mut last = rig.cycle();
    for (event, id) in events.iter().zip(1..) {
        let wish = wish(event, id, &rig.params.limits);
        for cycle in 0..event.cycles {
            // The pressure wanders, so that held flows are planned anew.
            rig.feedback.pressure_drop_pa = event.pressure_pa * (1.0 + 0.3 * (cycle as f64 * 0.05).sin());
            let reference = rig.cycles(1, (cycle == 0).then_some(&wish));
            look(rig, &last, &reference);
            last = reference;
        }
    }
}

/// Whether `next` follows from `last` by a motion that keeps the jerk limit.
fn check_continuity(limits: &Limits, last: &Reference, next: &Reference) {
    let (v, a, j) =
        (limits.max_speed_rad_per_s, limits.max_acceleration_rad_per_s2, limits.max_jerk_rad_per_s3);
    let t = PERIOD_S;
    // What the planner's tolerance and the last bit of the angle may cost.
    let unit = a.min((v * j).sqrt());
    let angle_slack = 1e-12 * (1.0 + next.angle_rad.abs()) + 1e-9 * unit.powi(3) / (j * j) + 2e-8 * v * t;
    let speed_slack = 1e-9 * v;
    let acceleration_slack = 1e-9 * a;
    let expected = last.acceleration_rad_per_s2;
    let change = next.acceleration_rad_per_s2 - expected;
    assert!(change.abs() <= j * t + acceleration_slack, "acceleration jumps by {change}");
    let expected =
        last.speed_rad_per_s + t * (last.acceleration_rad_per_s2 + next.acceleration_rad_per_s2) / 2.0;
    let change = next.speed_rad_per_s - expected;
    assert!(change.abs() <= j * t * t / 2.0 + speed_slack, "speed jumps by {change}: {last:?} {next:?}");
    let mean = (last.speed_rad_per_s + next.speed_rad_per_s) / 2.0;
    let change = next.angle_rad - (last.angle_rad + t * mean);
    // The trapezium's error: T²/12 times the change of acceleration, at most.
    let bound = t * t / 6.0 * (2.0 * a).min(2.0 * j * t) + angle_slack;
    assert!(change.abs() <= bound, "angle jumps by {change}, bound {bound}: {last:?} {next:?}");
}

fn check_limits(limits: &Limits, reference: &Reference) {
    let slack = 1.0 + 1e-9;
    assert!(reference.speed_rad_per_s.abs() <= limits.max_speed_rad_per_s * slack, "{reference:?}");
    assert!(
        reference.acceleration_rad_per_s2.abs() <= limits.max_acceleration_rad_per_s2 * slack,
        "{reference:?}"
    );
    assert!(reference.jerk_rad_per_s3.abs() <= limits.max_jerk_rad_per_s3 * slack, "{reference:?}");
    for angle in [reference.angle_rad, reference.target_angle_rad] {
        assert!(limits.min_angle_rad.is_none_or(|lowest| angle >= lowest - 2e-9), "{reference:?}");
        assert!(limits.max_angle_rad.is_none_or(|highest| angle <= highest + 2e-9), "{reference:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn limits_and_continuity_hold_whatever_is_asked(limits in limits(), events in events()) {
        let mut rig = Rig::running(limits, 0.0);
        play(&mut rig, &events, |rig, last, next| {
            check_limits(&rig.params.limits, next);
            check_continuity(&rig.params.limits, last, next);
            // Without limits of the angle every motion within the others can be planned.
            let sine = next.refused_id > 0 && events[next.refused_id as usize - 1].kind == SetPointKind::Sine;
            let planned = sine || next.refusal != SetPointRefusal::NoPlan.code() || limits.min_angle_rad.is_some();
            assert!(planned, "{next:?}");
            if next.moving == 0 {
                assert_eq!((next.speed_rad_per_s, next.acceleration_rad_per_s2, next.jerk_rad_per_s3), (0.0, 0.0, 0.0));
                assert_eq!(next.angle_rad, next.target_angle_rad);
            }
        });
    }

    #[test]
    fn the_same_inputs_give_the_same_bits(limits in limits(), events in events()) {
        let mut first = Vec::new();
        let mut second = Vec::new();
        play(&mut Rig::running(limits, 0.0), &events, |_, _, next| first.push(*next));
        play(&mut Rig::running(limits, 0.0), &events, |_, _, next| second.push(*next));
        prop_assert_eq!(format!("{first:?}"), format!("{second:?}"));
    }

    #[test]
    fn an_angle_is_reached_exactly_from_any_motion(limits in limits(), events in events(), share in 0.0..1.0_f64) {
        let mut rig = Rig::running(limits, 0.0);
        play(&mut rig, &events, |_, _, _| {});
        let (lowest, highest) = (limits.min_angle_rad.unwrap_or(-2.0), limits.max_angle_rad.unwrap_or(2.0));
        let target = lowest + share * (highest - lowest);
        // From a stop every angle within the limits can be reached.
        rig.set(&set_point(1000, SetPointKind::Hold, 0.0));
        rig.arrive();
        let set = rig.set(&set_point(1001, SetPointKind::Angle, target));
        prop_assert_eq!((set.set_point_id, set.target_angle_rad), (1001, target));
        let arrived = if set.moving == 0 { set } else { rig.arrive().0 };
        prop_assert_eq!(arrived.angle_rad, target);
        prop_assert_eq!(rig.cycle(), arrived);
    }

    /// What rounding adds must not add up: a new target in every cycle, as a held flow in noise has.
    #[test]
    fn a_target_in_every_cycle_is_always_planned(limits in limits(), angles in prop::collection::vec(-1.0..1.0_f64, 200..600),
        noise in -6.0..0.0_f64) {
        let limits = Limits { min_angle_rad: None, max_angle_rad: None, ..limits };
        let mut rig = Rig::running(limits, 0.0);
        let mut last = rig.cycle();
        for (angle, id) in angles.iter().zip(1..) {
            let next = rig.set(&set_point(id, SetPointKind::Angle, 1.0 + angle * 10_f64.powf(noise)));
            prop_assert_eq!(next.refused_id, 0);
            check_limits(&limits, &next);
            check_continuity(&limits, &last, &next);
            last = next;
        }
    }

    #[test]
    fn a_stop_always_comes(limits in limits(), events in events(), amplitude in 0.0..0.3_f64, frequency in 0.1..5.0_f64) {
        let mut rig = Rig::running(limits, 0.0);
        play(&mut rig, &events, |_, _, _| {});
        rig.set(&sine(1000, amplitude, frequency));
        for _ in 0..700 {
            rig.cycle();
        }
        let set = rig.set(&set_point(1001, SetPointKind::Hold, 0.0));
        prop_assert_eq!(set.set_point_id, 1001);
        let (arrived, cycles) = if set.moving == 0 { (set, 0) } else { rig.arrive() };
        prop_assert_eq!(arrived.speed_rad_per_s, 0.0);
        // A stop that waits does so for a turning point of the present motion, no longer.
        let (v, a, j) = (limits.max_speed_rad_per_s, limits.max_acceleration_rad_per_s2, limits.max_jerk_rad_per_s3);
        let fastest_s = v / a + 3.0 * a.min((v * j).sqrt()) / j;
        prop_assert!(cycles as f64 * PERIOD_S <= 4.0 * fastest_s + 2.0 / frequency + 0.01, "{} cycles", cycles);
    }

    #[test]
    fn skipped_cycles_lead_to_the_same_place(limits in limits(), events in events(), every in 1..20_u64) {
        let mut steady = Rig::running(limits, 0.0);
        play(&mut steady, &events, |_, _, _| {});
        let mut skipping = steady.clone();
        for _ in 0..30 {
            let mut last = Reference::default();
            for _ in 0..every {
                last = steady.cycle();
            }
            let reference = skipping.cycles(every, None);
            prop_assert!((reference.angle_rad - last.angle_rad).abs() <= 1e-12 * (1.0 + last.angle_rad.abs()),
                "{} {}", reference.angle_rad, last.angle_rad);
            prop_assert_eq!(reference.moving, last.moving);
        }
    }

    #[test]
    fn slowing_time_keeps_limits_and_continuity(limits in limits(), events in events(),
        paces in prop::collection::vec(0.0..1.0_f64, 15)) {
        let mut rig = Rig::running(limits, 0.0);
        let mut last = rig.cycle();
        for ((event, id), pace) in events.iter().zip(1..).zip(paces) {
            rig.status.time_scale = if pace < 0.2 { 0.0 } else if pace > 0.8 { 1.0 } else { pace };
            let wish = wish(event, id, &limits);
            for cycle in 0..event.cycles {
                let next = rig.cycles(1, (cycle == 0).then_some(&wish));
                let change = next.time_scale - last.time_scale;
                prop_assert!(change.abs() <= 20.0 * PERIOD_S + 1e-12);
                let slack = 1.0 + 1e-6;
                prop_assert!(next.speed_rad_per_s.abs() <= limits.max_speed_rad_per_s * slack);
                prop_assert!(next.acceleration_rad_per_s2.abs() <= limits.max_acceleration_rad_per_s2 * slack, "{:?} {:?}", last, next);
                let mean = (last.speed_rad_per_s + next.speed_rad_per_s) / 2.0;
                let jump = next.angle_rad - last.angle_rad - PERIOD_S * mean;
                prop_assert!(jump.abs() <= PERIOD_S * PERIOD_S * limits.max_acceleration_rad_per_s2 + 1e-9, "{}", jump);
                last = next;
            }
        }
    }
}

//! Each kind of set-point as a user sees it: accepted or refused, followed, arrived.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::{PERIOD_S, Rig, endless, limits, params, set_point, sine};
use signals::{ControllerState, HeldFlow, Reference, SetPoint, SetPointKind, SetPointRefusal, validity};
use trajectory::{Limits, Params, feasible};

fn flow(id: u64, flow_m3_per_s: f64, pressure_drop_pa: Option<f64>) -> SetPoint {
    SetPoint {
        pressure_given: u64::from(pressure_drop_pa.is_some()),
        pressure_drop_pa: pressure_drop_pa.unwrap_or(0.0),
        ..set_point(id, SetPointKind::Flow, flow_m3_per_s)
    }
}

fn refused(reference: &Reference, id: u64, refusal: SetPointRefusal) {
    assert_eq!((reference.refused_id, reference.refusal), (id, refusal.code()), "expected {refusal}");
}

#[test]
fn not_running_it_holds_at_the_measured_angle_and_refuses() {
    let mut rig = Rig::new(limits(), 0.3);
    let reference = rig.set(&set_point(7, SetPointKind::Angle, 0.5));
    refused(&reference, 7, SetPointRefusal::NotRunning);
    assert_eq!((reference.angle_rad, reference.set_point_id, reference.moving), (0.3, 0, 0));
    rig.feedback.angle_rad = 0.31;
    assert_eq!(rig.cycle().angle_rad, 0.31);
    // From the first status that says so on, it stays where it was published last.
    rig.status.state = ControllerState::Running.code();
    rig.feedback.angle_rad = 0.32;
    let held = rig.cycle();
    assert_eq!((held.angle_rad, held.target_angle_rad, held.moving), (0.31, 0.31, 0));
    assert_eq!(rig.set(&set_point(8, SetPointKind::Angle, 0.5)).set_point_id, 8);
    // And drops everything when running ends.
    for _ in 0..5 {
        assert_eq!(rig.cycle().moving, 1);
    }
    rig.status.state = ControllerState::QuickStop.code();
    let stopped = rig.cycle();
    assert_eq!((stopped.angle_rad, stopped.speed_rad_per_s), (0.32, 0.0));
    assert_eq!((stopped.set_point_id, stopped.moving), (0, 0));
}

#[test]
fn absent_messages_change_nothing() {
    let mut rig = Rig::running(limits(), 0.1);
    rig.set(&set_point(1, SetPointKind::Angle, 0.9));
    let mut deaf = rig.clone();
    for _ in 0..200 {
        let input = trajectory::Input { advance_cycles: 1, feedback: None, status: None, set_point: None };
        let reference = trajectory::step(&deaf.params, &mut deaf.state, &input);
        assert_eq!(reference, rig.cycle());
    }
}

#[test]
fn angle_opening_and_flow_lead_to_their_angles() {
    let mut rig = Rig::running(limits(), 0.0);
    rig.set(&set_point(1, SetPointKind::Angle, 0.6));
    assert_eq!(rig.arrive().0.angle_rad, 0.6);
    rig.set(&set_point(2, SetPointKind::Opening, 0.25));
    assert_eq!(rig.arrive().0.angle_rad, 0.25 * 0.8);
    let orifice = rig.params.orifice.unwrap();
    rig.set(&flow(3, 5e-4, Some(2e6)));
    let reference = rig.arrive().0;
    assert!((orifice.flow_m3_per_s(reference.angle_rad, 2e6, 853.0) - 5e-4).abs() < 1e-12);
    assert_eq!((reference.set_point_id, reference.set_point_kind), (3, SetPointKind::Flow.code()));
    // Given its pressure drop, the measured one does not matter.
    rig.feedback.pressure_drop_pa = 4e6;
    assert_eq!(rig.cycle(), reference);
}

#[test]
fn a_flow_holds_as_the_measured_pressure_changes() {
    let mut rig = Rig::running(limits(), 0.0);
    rig.feedback.pressure_drop_pa = 3e6;
    rig.set(&flow(1, 1e-3, None));
    rig.arrive();
    let orifice = rig.params.orifice.unwrap();
    let mut replanned = 0;
    for cycle in 0..4000 {
        let pressure = 3e6 + 1.5e6 * (f64::from(cycle) * 0.005).sin();
        rig.feedback.pressure_drop_pa = pressure;
        let reference = rig.cycle();
        let flow = orifice.flow_m3_per_s(reference.angle_rad, pressure, 853.0);
        assert!((flow / 1e-3 - 1.0).abs() < 0.02, "cycle {cycle}: {flow} m³/s");
        replanned += reference.moving;
        assert_eq!((reference.refused_id, reference.held_flow), (0, HeldFlow::Held.code()));
    }
    assert!(replanned > 1000);
    // Within the stated 1e-4 rad once the pressure stays.
    let reference = rig.arrive().0;
    let wanted = orifice.angle_for_flow(1e-3, rig.feedback.pressure_drop_pa, 853.0).unwrap();
    assert!((reference.angle_rad - wanted).abs() <= 1e-4);
    // Without a measured pressure it stays.
    rig.feedback.validity &= !validity::PRESSURE;
    rig.feedback.pressure_drop_pa = 2e6;
    let reference = rig.cycle();
    assert_eq!((reference.moving, reference.held_flow), (0, HeldFlow::NoPressure.code()));
}

/// What is out of reach is told from the first cycle on, once, and not again and again where the pressure drop is measured with noise.
#[test]
fn a_held_flow_out_of_reach_is_told() {
    let mut rig = Rig::running(limits(), 0.0);
    rig.feedback.pressure_drop_pa = 3e6;
    let orifice = rig.params.orifice.unwrap();
    let most_m3_per_s = orifice.flow_m3_per_s(orifice.open_angle_rad, 3e6, 853.0);
    assert_eq!(rig.set(&flow(1, 0.9 * most_m3_per_s, None)).held_flow, HeldFlow::Held.code());
    assert_eq!(rig.arrive().0.held_flow, HeldFlow::Held.code());
    // 0.9 of the flow at 3 MPa need 0.81 of the pressure drop.
    let table = [
        (0.80, HeldFlow::OutOfReach, "beyond the orifice"),
        (0.815, HeldFlow::OutOfReach, "not yet clearly within it"),
        (0.79, HeldFlow::OutOfReach, "beyond it again"),
        (0.85, HeldFlow::Held, "within it"),
        (0.815, HeldFlow::Held, "still within it"),
        (0.0, HeldFlow::OutOfReach, "no pressure drop at all"),
        (-1.0, HeldFlow::OutOfReach, "a pressure drop the other way"),
        (1.0, HeldFlow::Held, "as at first"),
    ];
    for (part, held, what) in table {
        rig.feedback.pressure_drop_pa = part * 3e6;
        assert_eq!(rig.cycle().held_flow, held.code(), "{what}");
        let reference = rig.arrive().0;
        assert_eq!(reference.held_flow, held.code(), "{what}, arrived");
        if held == HeldFlow::OutOfReach && (0.0..0.81).contains(&part) && part > 0.0 {
            assert_eq!(reference.angle_rad, orifice.open_angle_rad, "{what}");
        }
    }
    // Limits of motion within the orifice's travel count as its end does.
    rig.params.limits.max_angle_rad = Some(0.5 * orifice.open_angle_rad);
    let reference = rig.arrive().0;
    assert_eq!(reference.held_flow, HeldFlow::OutOfReach.code());
    // Another set-point ends it.
    let reference = rig.set(&set_point(2, SetPointKind::Angle, 0.1));
    assert_eq!(reference.held_flow, HeldFlow::None.code());
}

#[test]
fn refusals_name_the_reason_and_leave_the_motion() {
    use SetPointRefusal as Refusal;
    let with = |change: fn(&mut Rig)| {
        let mut rig = Rig::running(limits(), 0.0);
        change(&mut rig);
        rig
    };
    let same = |_: &mut Rig| {};
    let cases: Vec<(Rig, SetPoint, SetPointRefusal)> = vec![
        (with(same), set_point(9, SetPointKind::Angle, 1.001), Refusal::AngleLimit),
        (with(same), set_point(9, SetPointKind::Opening, 1.001), Refusal::AngleLimit),
        (with(same), set_point(9, SetPointKind::Speed, 1.0), Refusal::AngleLimit),
        (Rig::running(endless(), 0.0), set_point(9, SetPointKind::Speed, 20.001), Refusal::SpeedLimit),
        (with(same), sine(9, 0.6, 0.1), Refusal::AngleLimit),
        (with(same), sine(9, 0.4, 10.0), Refusal::SpeedLimit),
        (with(same), sine(9, 0.05, 30.0), Refusal::AccelerationLimit),
        (with(same), sine(9, 0.001, 100.0), Refusal::NoPlan),
        (with(same), sine(9, 1e-9, 500.0), Refusal::NoPlan),
        (with(same), sine(9, 0.1, 0.0), Refusal::NoPlan),
        (with(same), flow(9, 1.0, Some(1e6)), Refusal::Flow),
        (with(same), flow(9, 1e-4, Some(-1e6)), Refusal::Flow),
        (with(|rig| rig.feedback.validity = validity::HOMED), flow(9, 1e-4, None), Refusal::NoPressure),
        (with(|rig| rig.feedback.validity = 0), set_point(9, SetPointKind::Angle, 0.1), Refusal::NotHomed),
        (with(|rig| rig.params.orifice = None), set_point(9, SetPointKind::Opening, 0.1), Refusal::NoOrifice),
        (with(|rig| rig.params.oil_density_kg_per_m3 = None), flow(9, 1e-4, Some(1e6)), Refusal::NoOrifice),
    ];
    for (mut rig, wish, refusal) in cases {
        let mut undisturbed = rig.clone();
        let reference = rig.set(&wish);
        refused(&reference, 9, refusal);
        let expected = undisturbed.cycle();
        assert_eq!(Reference { refused_id: 0, refusal: 0, ..reference }, expected);
    }
}

#[test]
fn a_refused_set_point_leaves_a_motion_as_it_is() {
    let mut rig = Rig::running(limits(), 0.0);
    rig.set(&set_point(1, SetPointKind::Angle, 0.9));
    for _ in 0..20 {
        rig.cycle();
    }
    let mut undisturbed = rig.clone();
    refused(&rig.set(&set_point(2, SetPointKind::Angle, 7.0)), 2, SetPointRefusal::AngleLimit);
    undisturbed.cycle();
    for _ in 0..300 {
        let reference = rig.cycle();
        assert_eq!(Reference { refused_id: 0, refusal: 0, ..reference }, undisturbed.cycle());
    }
}

/// A sine turns back at the very limit, braking harder there than a stop can let go of: from just before its top the
/// shortest stop, and the fastest way to rest at the top, swing beyond the limit. The stop has to wait a little, and
/// the set-point is refused.
#[test]
fn no_motion_swings_beyond_a_limit() {
    let bounded = Limits {
        min_angle_rad: Some(-0.5),
        max_angle_rad: Some(0.5),
        max_speed_rad_per_s: 6.4,
        max_acceleration_rad_per_s2: 92.0,
        max_jerk_rad_per_s3: 1550.0,
        unhomed_speed_rad_per_s: 0.2,
    };
    let free = Limits { min_angle_rad: None, max_angle_rad: None, ..bounded };
    let highest = |limits: Limits, wish: &SetPoint, delay: u64| {
        let mut rig = Rig::running(limits, 0.0);
        rig.set(&sine(1, 0.5, 2.0));
        for _ in 0..600 + delay {
            rig.cycle();
        }
        let set = rig.set(wish);
        assert!(set.refused_id == 0 || wish.kind != SetPointKind::Hold.code(), "a stop is never refused");
        let highest = (0..1000).map(|_| rig.cycle().angle_rad).fold(f64::NEG_INFINITY, f64::max);
        assert!(set.refused_id == 2 || rig.cycle().moving == 0);
        (highest, set.refused_id == 2)
    };
    let (mut late_stops, mut refusals) = (0, 0);
    for delay in (0..500).step_by(3) {
        for wish in [set_point(2, SetPointKind::Hold, 0.0), set_point(2, SetPointKind::Angle, 0.5)] {
            let (swing, refused) = highest(bounded, &wish, delay);
            assert!(swing <= 0.5 + 1e-9, "{swing} after {delay} cycles");
            refusals += u32::from(refused);
            let (swing, _) = highest(free, &wish, delay);
            late_stops += u32::from(swing > 0.5 + 1e-6 && wish.kind == SetPointKind::Hold.code());
        }
    }
    println!("{late_stops} stops had to wait, {refusals} set-points were refused");
    assert!(late_stops > 0 && refusals > 0, "the scenario does not come near the limit");
}

#[test]
fn rotation_keeps_its_angle_for_days() {
    let speed = 11.170_107_212_763_71; // 200 kHz of 225 × 500 micro-steps in a turn
    let mut rig = Rig::running(endless(), 0.0);
    rig.set(&set_point(1, SetPointKind::Speed, speed));
    for _ in 0..1000 {
        rig.cycle();
    }
    let before = rig.cycle();
    assert_eq!((before.speed_rad_per_s, before.moving), (speed, 1));
    assert_eq!(before.target_angle_rad, before.angle_rad);
    let cycles = 300_000;
    for _ in 1..cycles {
        rig.cycle();
    }
    let after = rig.cycle();
    let expected = before.angle_rad + speed * cycles as f64 * PERIOD_S;
    assert!((after.angle_rad - expected).abs() < 1e-11 * expected, "{} {expected}", after.angle_rad);
    let days = rig.cycles(200_000_000, None);
    let expected = after.angle_rad + speed * 200_000_000.0 * PERIOD_S;
    assert!((days.angle_rad - expected).abs() < 1e-15 * 4.0 * expected);
    // And ends where it is told to.
    let target = (days.angle_rad + 100.0).round();
    rig.set(&set_point(2, SetPointKind::Angle, target));
    assert_eq!(rig.arrive().0.angle_rad, target);
    rig.set(&set_point(3, SetPointKind::Speed, 0.0));
    assert_eq!(rig.cycle().moving, 0);
}

#[test]
fn a_sine_goes_about_where_the_valve_rests_or_comes_to_rest() {
    let mut rig = Rig::running(limits(), 0.2);
    rig.set(&sine(1, 0.2, 1.0));
    let mut values = Vec::new();
    for _ in 0..3999 {
        values.push(rig.cycle());
    }
    for (i, reference) in values.iter().enumerate().skip(1000) {
        let time_s = (i + 2) as f64 * PERIOD_S;
        let expected = 0.2 + 0.2 * (std::f64::consts::TAU * time_s).sin();
        assert!((reference.angle_rad - expected).abs() < 1e-12);
        assert_eq!((reference.moving, reference.set_point_kind), (1, SetPointKind::Sine.code()));
    }
    // The next one in full motion: a stop, then the sine about that angle.
    let stop = {
        let mut rig = rig.clone();
        rig.set(&set_point(2, SetPointKind::Hold, 0.0));
        rig.arrive().0.angle_rad
    };
    rig.set(&sine(2, 0.05, 2.0));
    let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
    for cycle in 0..3000 {
        let reference = rig.cycle();
        if cycle > 1500 {
            lowest = reference.angle_rad.min(lowest);
            highest = reference.angle_rad.max(highest);
        }
    }
    assert!((lowest - (stop - 0.05)).abs() < 1e-4 && (highest - (stop + 0.05)).abs() < 1e-4);
}

#[test]
fn a_valve_outside_its_limits_may_come_back() {
    let mut rig = Rig::running(limits(), -0.7);
    refused(&rig.set(&set_point(1, SetPointKind::Angle, -0.6)), 1, SetPointRefusal::AngleLimit);
    rig.set(&set_point(2, SetPointKind::Angle, -0.4));
    assert_eq!(rig.arrive().0.angle_rad, -0.4);
}

#[test]
fn slower_time_takes_the_same_way_more_slowly() {
    let mut normal = Rig::running(limits(), 0.0);
    let mut slow = normal.clone();
    slow.status.time_scale = 0.5;
    for _ in 0..100 {
        slow.cycle();
    }
    normal.set(&set_point(1, SetPointKind::Angle, 0.8));
    slow.set(&set_point(1, SetPointKind::Angle, 0.8));
    for _ in 0..40 {
        assert_eq!(normal.cycle().time_scale, 1.0);
        slow.cycle();
        assert_eq!(slow.cycle().time_scale, 0.5);
    }
    let (_, fast_cycles) = normal.arrive();
    let (arrived, slow_cycles) = slow.arrive();
    assert_eq!(arrived.angle_rad, 0.8);
    let difference = (41 + fast_cycles) as i64 * 2 - (81 + slow_cycles) as i64;
    assert!(difference.abs() <= 2, "{fast_cycles} and {slow_cycles}");
    // Time that stands still holds the motion, without an end to it.
    slow.set(&set_point(2, SetPointKind::Angle, 0.0));
    slow.status.time_scale = 0.0;
    for _ in 0..200 {
        slow.cycle();
    }
    let held = slow.cycle();
    assert_eq!((held.speed_rad_per_s, held.moving, held.time_scale), (0.0, 1, 0.0));
    assert_eq!(slow.cycle().angle_rad, held.angle_rad);
    slow.status.time_scale = 1.0;
    assert_eq!(slow.arrive().0.angle_rad, 0.0);
}

#[test]
fn feasible_says_before_a_run_what_the_run_would_say() {
    let params = params(limits());
    let none = Params { orifice: None, ..params };
    assert_eq!(feasible(&params, 0.0, &set_point(1, SetPointKind::Angle, 0.9)), Ok(()));
    let refusal = |params: &Params, wish: &SetPoint| feasible(params, 0.0, wish).unwrap_err();
    assert_eq!(refusal(&params, &set_point(1, SetPointKind::Angle, 1.1)), SetPointRefusal::AngleLimit);
    assert_eq!(refusal(&params, &sine(1, 0.4, 10.0)), SetPointRefusal::SpeedLimit);
    assert_eq!(refusal(&none, &flow(1, 1e-4, None)), SetPointRefusal::NoOrifice);
    assert_eq!(feasible(&params, 0.0, &flow(1, 1e-4, None)), Ok(()));
    assert_eq!(refusal(&params, &flow(1, 1.0, Some(1e6))), SetPointRefusal::Flow);
    assert_eq!(
        refusal(&params, &SetPoint { pressure_drop_pa: 1e6, ..flow(1, 1.0, None) }),
        SetPointRefusal::Flow
    );
}

#[test]
fn parameters_that_make_no_trajectory_are_refused() {
    let good = params(limits());
    let bad_limits = [
        Limits { min_angle_rad: Some(2.0), ..good.limits },
        Limits { max_angle_rad: Some(f64::NAN), ..good.limits },
        Limits { max_speed_rad_per_s: 0.0, ..good.limits },
        Limits { max_acceleration_rad_per_s2: -1.0, ..good.limits },
        Limits { max_jerk_rad_per_s3: f64::INFINITY, unhomed_speed_rad_per_s: 0.2, ..good.limits },
    ];
    for limits in bad_limits {
        println!("{}", Params { limits, ..good }.validate().unwrap_err());
    }
    assert!(Params { period_s: f64::NAN, ..good }.validate().is_err());
    assert!(Params { oil_density_kg_per_m3: Some(0.0), ..good }.validate().is_err());
    assert!(good.validate().is_ok());
}

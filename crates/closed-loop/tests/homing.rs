//! Arming and homing as a user meets them: current that comes late, marks at random places, teeth at random offsets.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use closed_loop::{CycleMessages, Operated, Parts, PlantStart, Wanted, wire};
use common::{Valve, scenario};
use config::{HomingMarks, HomingMethod, HomingSearch, Scenario};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use signals::{
    ControllerState, FaultCode, HomingPhase, OperatorCommand, OperatorKind, OperatorResult, SetPointKind,
    SetPointRefusal, validity,
};

/// Gives an order that takes its time, and says what came of it.
fn complete(bench: &mut Operated, kind: OperatorKind) -> (OperatorResult, CycleMessages) {
    bench.order(kind);
    let result = bench.end_of_order(200_000);
    let last = *bench.last().unwrap();
    assert_ne!(result, OperatorResult::Begun, "{kind} never ends: {:?}", last.status);
    (result, last)
}

/// Gives a set-point; the messages once it has been answered.
fn set(bench: &mut Operated, kind: SetPointKind, value: f64) -> CycleMessages {
    bench.set(kind, value);
    bench.run(3)
}

fn parts(scenario: &Scenario, truth: &Valve) -> Parts {
    wire(scenario, &truth.model(), &Valve::default().model()).unwrap()
}

fn state(messages: &CycleMessages) -> ControllerState {
    ControllerState::from_code(messages.status.state).unwrap()
}

#[test]
fn disarmed_means_without_current_and_arming_waits_for_the_drive() {
    let scenario = scenario(1.0, "");
    let mut slow = scenario.clone();
    slow.driver.energise_time_s = 0.2;
    let mut bench = Operated::new(parts(&slow, &Valve::default()));
    let disarmed = bench.run(50);
    assert_eq!((disarmed.command.energise, disarmed.command.follow), (0, 0));
    assert_eq!(disarmed.plant.feedback.validity & validity::ENERGISED, 0);
    let begun = bench.order(OperatorKind::Arm);
    assert_eq!(begun.status.operator_result, OperatorResult::Begun.code());
    let arming = bench.run(195);
    assert_eq!(
        (state(&arming), arming.command.energise, arming.command.follow),
        (ControllerState::Arming, 1, 0)
    );
    let running = bench.run(20);
    assert_eq!((state(&running), running.command.follow), (ControllerState::Running, 1));
    assert_eq!(running.status.operator_result, OperatorResult::Done.code());
    bench.order(OperatorKind::Disarm);
    let after = bench.run(100);
    assert_eq!((state(&after), after.command.energise), (ControllerState::Disarmed, 0));
    assert_eq!(after.plant.feedback.validity & validity::ENERGISED, 0);

    slow.driver.energise_time_s = 0.0;
    slow.driver.holds_when_disarmed = true;
    let held = Operated::new(parts(&slow, &Valve::default())).run(50);
    assert_eq!((state(&held), held.command.energise), (ControllerState::Disarmed, 1));
    assert!(held.plant.feedback.validity & validity::ENERGISED != 0);
}

#[test]
fn a_drive_that_never_energises_is_a_fault_and_nothing_was_followed() {
    let mut scenario = scenario(1.0, "");
    scenario.driver.energise_time_s = 3.0;
    let mut bench = Operated::new(parts(&scenario, &Valve::default()));
    bench.run(20);
    let (result, last) = complete(&mut bench, OperatorKind::Arm);
    assert_eq!((result, last.status.fault), (OperatorResult::Failed, FaultCode::NotEnergised.code()));
    assert!((2000..2100).contains(&(bench.cycle() - 20)), "after {} cycles", bench.cycle() - 20);
    assert_eq!(last.command.follow, 0);
}

#[test]
fn an_order_that_comes_too_late_does_nothing() {
    let mut bench = Operated::new(parts(&scenario(1.0, ""), &Valve::default()));
    bench.run(30);
    let late = OperatorCommand {
        id: 1,
        valid_until_cycle: 29,
        kind: OperatorKind::Arm.code(),
        ..OperatorCommand::default()
    };
    let refused = bench.step(Wanted { order: Some(late), set_point: None });
    assert_eq!(refused.status.operator_result, OperatorResult::Expired.code());
    assert_eq!(state(&bench.run(50)), ControllerState::Disarmed);
    // The same id once more, in time: it was looked at already.
    bench.step(Wanted { order: Some(OperatorCommand { valid_until_cycle: 1000, ..late }), set_point: None });
    assert_eq!(state(&bench.run(50)), ControllerState::Disarmed);
    bench.step(Wanted {
        order: Some(OperatorCommand { id: 2, valid_until_cycle: bench.cycle(), ..late }),
        set_point: None,
    });
    assert_eq!(state(&bench.run(50)), ControllerState::Running);
}

#[test]
fn energising_pulls_the_rotor_to_the_nearest_tooth_of_the_phase() {
    for angle_rad in [0.3, 0.31, 0.33, -0.27] {
        let mut scenario = scenario(1.0, "");
        scenario.initial_angle_rad = angle_rad;
        scenario.homing.begins_homed = false;
        let truth = Valve { coulomb_torque_nm: 0.05, static_torque_nm: 0.06, ..Valve::default() };
        let mut bench = Operated::new(parts(&scenario, &truth));
        bench.run(20);
        assert_eq!(complete(&mut bench, OperatorKind::Arm).0, OperatorResult::Done);
        let rests = bench.run(300);
        let tooth_rad = std::f64::consts::TAU / 50.0;
        let nearest_rad = (angle_rad / tooth_rad).round() * tooth_rad;
        let beside_rad = rests.plant.truth.angle_rad - nearest_rad;
        assert!(beside_rad.abs() < 1e-3, "from {angle_rad}: {beside_rad} rad beside {nearest_rad}");
        assert_eq!(rests.status.fault, 0, "the jump is no fault");
    }
}

#[test]
fn a_valve_that_is_not_homed_jogs_slowly_and_does_nothing_else() {
    let mut scenario = scenario(1.0, "");
    scenario.homing.begins_homed = false;
    (scenario.limits.min_angle_rad, scenario.limits.max_angle_rad) = (Some(-0.1), Some(0.1));
    let mut bench = Operated::new(parts(&scenario, &Valve::default()));
    bench.run(20);
    assert_eq!(complete(&mut bench, OperatorKind::Arm).0, OperatorResult::Done);
    let most = scenario.limits.unhomed_speed_rad_per_s;
    let refused =
        [(SetPointKind::Angle, 0.01), (SetPointKind::Sine, 0.01), (SetPointKind::Speed, 1.1 * most)];
    for (number, (kind, value)) in (1..).zip(refused) {
        let answer = set(&mut bench, kind, value);
        assert_eq!(answer.reference.refusal, SetPointRefusal::NotHomed.code(), "{kind}");
        assert_eq!(answer.reference.refused_id, number, "{kind}");
    }
    let jogs = set(&mut bench, SetPointKind::Speed, most);
    assert_eq!(jogs.reference.set_point_id, 4);
    let far = bench.run(2000);
    assert!(far.plant.feedback.angle_rad > 0.2, "limits of angle mean nothing yet: {:?}", far.plant.feedback);
    assert_eq!((state(&far), far.status.fault), (ControllerState::Running, 0));
}

/// A valve just switched on, somewhere, with its marks.
fn switched_on(rng: &mut Pcg64Mcg, method: HomingMethod) -> (Scenario, f64) {
    let mut scenario = scenario(1.0, "");
    let towards = if rng.random() { 1.0 } else { -1.0 };
    let mark_rad: f64 = rng.random_range(-0.5..0.5);
    scenario.seed = rng.random_range(0..1 << 60);
    scenario.initial_angle_rad = mark_rad - towards * rng.random_range(0.3..0.8);
    scenario.homing.begins_homed = false;
    scenario.encoder.absolute = method == HomingMethod::Absolute;
    scenario.homing.search = Some(HomingSearch {
        method,
        speed_rad_per_s: towards * rng.random_range(0.1..0.4),
        angle_rad: mark_rad,
        longest_rad: 1.5,
        stop_current: 0.7,
        largest_spread_rad: 4e-3,
    });
    scenario.homing.marks = HomingMarks::of(method, mark_rad, towards);
    (scenario, mark_rad)
}

#[test]
fn homing_finds_zero_and_teeth_wherever_they_are() {
    let methods = [HomingMethod::Switch, HomingMethod::Stop, HomingMethod::Index, HomingMethod::Absolute];
    for method in methods {
        for seed in 0..12 {
            let mut rng = Pcg64Mcg::seed_from_u64(seed);
            let (scenario, mark_rad) = switched_on(&mut rng, method);
            let mut bench = Operated::new(parts(&scenario, &Valve::default()));
            bench.run(20);
            let (result, last) = complete(&mut bench, OperatorKind::Home);
            let what = format!("{method:?}, seed {seed}, mark at {mark_rad}: {:?}", last.status);
            assert_eq!(result, OperatorResult::Done, "{what}");
            assert_eq!(last.status.homing_phase, HomingPhase::Done.code(), "{what}");
            let homed = bench.run(100);
            assert_eq!(state(&homed), ControllerState::Disarmed);
            let (feedback, truth) = (&homed.plant.feedback, &homed.plant.truth);
            assert!(feedback.validity & validity::HOMED != 0, "{what}");
            let zero_rad = feedback.angle_rad - truth.angle_rad;
            assert!(zero_rad.abs() < 1e-3, "{what}: the zero is {zero_rad} rad off");
            // Encoder and teeth agree: what the count says is where the phase holds the rotor, teeth aside.
            let microstep_rad = std::f64::consts::TAU / 112_500.0;
            let count_rad = feedback.accepted_microsteps as f64 * microstep_rad;
            let tooth_rad = std::f64::consts::TAU / 50.0;
            let apart = (count_rad - zero_rad - truth.command_angle_rad) / tooth_rad;
            let teeth_rad = (apart - apart.round()) * tooth_rad;
            assert!(teeth_rad.abs() < 3e-4, "{what}: teeth are {teeth_rad} rad off");
        }
    }
}

#[test]
fn a_homed_valve_goes_where_it_is_sent() {
    let (scenario, _) = switched_on(&mut Pcg64Mcg::seed_from_u64(5), HomingMethod::Switch);
    let mut bench = Operated::new(parts(&scenario, &Valve::default()));
    bench.run(20);
    assert_eq!(complete(&mut bench, OperatorKind::Home).0, OperatorResult::Done);
    bench.run(100);
    assert_eq!(complete(&mut bench, OperatorKind::Arm).0, OperatorResult::Done);
    set(&mut bench, SetPointKind::Angle, 0.25);
    let there = bench.run(500);
    assert!((there.plant.truth.angle_rad - 0.25).abs() < 1e-3, "{}", there.plant.truth.angle_rad);
    assert_eq!(there.status.fault, 0);
}

#[test]
fn homing_that_finds_nothing_is_a_fault_and_the_valve_stays_unhomed() {
    for method in [HomingMethod::Switch, HomingMethod::Stop, HomingMethod::Index] {
        let (mut scenario, _) = switched_on(&mut Pcg64Mcg::seed_from_u64(1), method);
        scenario.homing.marks = HomingMarks {
            switch_angle_rad: None,
            index_angle_rad: None,
            low_stop_rad: None,
            high_stop_rad: None,
        };
        let mut bench = Operated::new(parts(&scenario, &Valve::default()));
        bench.run(20);
        let (result, last) = complete(&mut bench, OperatorKind::Home);
        assert_eq!(
            (result, last.status.fault),
            (OperatorResult::Failed, FaultCode::Homing.code()),
            "{method:?}"
        );
        let after = bench.run(200);
        assert_eq!(state(&after), ControllerState::Fault);
        assert_eq!(after.plant.feedback.validity & validity::HOMED, 0);
    }
}

#[test]
fn friction_beyond_the_reduced_current_is_no_stop() {
    let (scenario, _) = switched_on(&mut Pcg64Mcg::seed_from_u64(3), HomingMethod::Stop);
    let stiff = Valve { coulomb_torque_nm: 4.4, static_torque_nm: 4.6, ..Valve::default() };
    let mut bench = Operated::new(parts(&scenario, &stiff));
    bench.run(20);
    let (result, last) = complete(&mut bench, OperatorKind::Home);
    assert_eq!((result, last.status.fault), (OperatorResult::Failed, FaultCode::Homing.code()));
}

#[test]
fn teeth_that_do_not_agree_refuse_the_alignment() {
    let (mut scenario, _) = switched_on(&mut Pcg64Mcg::seed_from_u64(5), HomingMethod::Switch);
    if let Some(search) = scenario.homing.search.as_mut() {
        search.largest_spread_rad = 1e-7;
    }
    let mut bench = Operated::new(parts(&scenario, &Valve::default()));
    bench.run(20);
    let (result, last) = complete(&mut bench, OperatorKind::Home);
    assert_eq!((result, last.status.fault), (OperatorResult::Failed, FaultCode::Homing.code()));
    assert!(last.status.alignment_spread_rad > 1e-7, "{:?}", last.status);
    assert_eq!(bench.run(200).plant.feedback.validity & validity::HOMED, 0);
}

/// Cycles at which homing is interrupted: the first, middle and last of each phase, and all of the few in which the drive takes its zero.
fn moments(parts: &Parts) -> Vec<(HomingPhase, u64)> {
    let mut bench = Operated::new(parts.clone());
    bench.run(20);
    let mut last = bench.order(OperatorKind::Home);
    let mut phases: Vec<(u64, std::ops::Range<u64>)> = Vec::new();
    for cycle in 0..100_000 {
        let phase = last.status.homing_phase;
        match phases.last_mut().filter(|(before, _)| *before == phase) {
            Some((_, range)) => range.end = cycle + 1,
            None => phases.push((phase, cycle..cycle + 1)),
        }
        if phase == HomingPhase::Done.code() {
            break;
        }
        last = bench.step(Wanted::default());
    }
    let named = phases.into_iter().map(|(code, range)| (HomingPhase::from_code(code).unwrap(), range));
    let inner = named.filter(|(phase, _)| ![HomingPhase::None, HomingPhase::Done].contains(phase));
    inner
        .flat_map(|(phase, range)| {
            let cycles = match phase {
                HomingPhase::SetZero => range.collect(),
                _ => vec![range.start, range.start.midpoint(range.end), range.end - 1],
            };
            cycles.into_iter().map(move |cycle| (phase, cycle))
        })
        .collect()
}

#[test]
fn homing_interrupted_in_any_phase_stops_and_can_be_repeated() {
    let methods = [HomingMethod::Switch, HomingMethod::Stop, HomingMethod::Index, HomingMethod::Absolute];
    let mut met = std::collections::BTreeSet::new();
    for (method, seed) in methods.into_iter().flat_map(|method| (5..8).map(move |seed| (method, seed))) {
        let (scenario, mark_rad) = switched_on(&mut Pcg64Mcg::seed_from_u64(seed), method);
        let parts = parts(&scenario, &Valve::default());
        for (phase, after) in moments(&parts) {
            met.insert(phase.code());
            let what =
                format!("{method:?}, seed {seed}: interrupted {after} cycles after the order, in {phase}");
            let mut bench = Operated::new(parts.clone());
            bench.run(20);
            let mut begun = bench.order(OperatorKind::Home);
            if after > 0 {
                begun = bench.run(after);
            }
            assert_eq!(begun.status.homing_phase, phase.code(), "{what}");
            bench.order(OperatorKind::Disarm);
            let stopped = bench.run(300);
            assert_eq!(state(&stopped), ControllerState::Disarmed, "{what}");
            let feedback = &stopped.plant.feedback;
            assert_eq!(feedback.pulse_rate_hz, 0.0, "{what}");
            // A zero that the drive has taken is right; one that was on its way is the only one that it may still take.
            let homed = feedback.validity & validity::HOMED != 0;
            assert!(!homed || phase == HomingPhase::SetZero, "{what}");
            let zero_rad = feedback.angle_rad - stopped.plant.truth.angle_rad;
            assert!(!homed || zero_rad.abs() < 1e-3, "{what}: the zero is {zero_rad} rad off");
            let towards = scenario.homing.search.as_ref().unwrap().speed_rad_per_s.signum();
            let rests_rad = stopped.plant.truth.angle_rad;
            let (result, again) = complete(&mut bench, OperatorKind::Home);
            // An index that lies behind is not met by going on: that is a fault, and nothing is homed.
            let behind = method == HomingMethod::Index && towards * (rests_rad - mark_rad) > -1e-3;
            if behind && result == OperatorResult::Failed {
                assert_eq!(again.status.fault, FaultCode::Homing.code(), "{what}");
                continue;
            }
            assert_eq!(result, OperatorResult::Done, "{what}: {:?}", again.status);
            let homed = bench.run(100).plant;
            let zero_rad = homed.feedback.angle_rad - homed.truth.angle_rad;
            assert!(zero_rad.abs() < 1e-3, "{what}: then the zero is {zero_rad} rad off");
        }
    }
    assert_eq!(met.len(), 5, "all phases but none and done: {met:?}");
}

/// What is asked of the drive goes with the order: a drive that could not take its zero yet takes none later.
#[test]
fn a_zero_that_nobody_waits_for_any_more_is_withdrawn() {
    let (scenario, _) = switched_on(&mut Pcg64Mcg::seed_from_u64(5), HomingMethod::Switch);
    let parts = parts(&scenario, &Valve::default());
    let set_zero = moments(&parts).into_iter().find(|(phase, _)| *phase == HomingPhase::SetZero).unwrap().1;
    let mut bench = Operated::new(parts);
    bench.run(20);
    bench.order(OperatorKind::Home);
    let asks = bench.run(set_zero);
    assert!(asks.command.zero_id > asks.plant.feedback.zero_id, "the drive is asked");
    let disarmed = bench.order(OperatorKind::Disarm);
    assert_eq!(disarmed.command.zero_id, 0);
}

#[test]
fn what_is_known_of_the_position_outlives_the_process_where_current_or_encoder_kept_it() {
    let mut scenario = scenario(1.0, "");
    for (holds, absolute, energised, homed) in
        [(true, false, true, true), (false, false, false, false), (false, true, false, true)]
    {
        scenario.driver.holds_when_disarmed = holds;
        scenario.encoder.absolute = absolute;
        let mut before = Operated::new(parts(&scenario, &Valve::default()));
        before.run(20);
        assert_eq!(complete(&mut before, OperatorKind::Arm).0, OperatorResult::Done);
        set(&mut before, SetPointKind::Angle, 0.5);
        before.run(500);
        before.order(OperatorKind::Disarm);
        let left = before.run(100);
        let mut again = parts(&scenario, &Valve::default());
        let microstep_rad = again.plant.drive.microstep_angle_rad;
        let (feedback, truth) = (&left.plant.feedback, &left.plant.truth);
        again.plant.start = PlantStart::left_by(feedback, truth, microstep_rad, absolute);
        let first = Operated::new(again).run(1).plant.feedback;
        assert!((first.angle_rad - truth.angle_rad).abs() < 1e-4, "{}", first.angle_rad);
        assert_eq!(first.accepted_microsteps, feedback.accepted_microsteps);
        assert_eq!(first.validity & validity::HOMED != 0, homed, "{holds} {absolute}");
        assert_eq!(first.validity & validity::ENERGISED != 0, energised);
    }
}

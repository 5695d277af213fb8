//! What the simulated drive says of itself, held against what the loop did, and limits that a scenario leads to.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use closed_loop::{CycleMessages, InProcess, Level, PlantStart, measure, wire};
use common::{Valve, scenario};
use config::{HomingMarks, ScheduledSetPoint, SetPoint};
use drive::AfterStop;
use signals::{FaultCode, Feedback, PlantTruth, validity};
use std::f64::consts::TAU;
use valve_model::{Effect, EffectValue};

fn steps() -> config::Scenario {
    let mut scenario = scenario(1.0, "");
    let to =
        |time_s, angle_rad| ScheduledSetPoint { time_s, set_point: SetPoint::Angle { angle_rad }, line: 0 };
    scenario.set_points = vec![to(0.1, 0.4), to(0.6, -0.2)];
    scenario
}

fn run(scenario: &config::Scenario, truth: &valve_model::Model) -> Vec<CycleMessages> {
    InProcess::new(&wire(scenario, truth, &Valve::default().model()).unwrap()).collect()
}

#[test]
fn the_pulse_rate_told_is_the_change_of_the_position_told() {
    let (scenario, truth) = (steps(), Valve::default().model());
    let messages = run(&scenario, &truth);
    let mut moved = 0;
    for pair in messages.windows(2) {
        let (before, after) = (&pair[0].plant.feedback, &pair[1].plant.feedback);
        let way = (after.accepted_microsteps - before.accepted_microsteps) as f64;
        let told = after.pulse_rate_hz * scenario.period_s();
        // Positions are rounded at either end.
        assert!((way - told).abs() <= 1.0 + 1e-9, "cycle {}: {way} pulses, {told} told", pair[1].cycle);
        moved += u64::from(told.abs() > 10.0);
    }
    assert!(moved > 50, "{moved} cycles in motion");
}

#[test]
fn the_switch_and_the_index_are_told_where_they_are_and_nowhere_else() {
    let mut scenario = steps();
    scenario.homing.marks = HomingMarks {
        switch_angle_rad: Some(0.1),
        index_angle_rad: Some(0.25),
        low_stop_rad: None,
        high_stop_rad: None,
    };
    let messages = run(&scenario, &Valve::default().model());
    let (mut on, mut passed) = (0, 0);
    for pair in messages.windows(2) {
        let (feedback, truth) = (&pair[1].plant.feedback, &pair[1].plant.truth);
        let switched = feedback.validity & validity::HOME_SWITCH != 0;
        assert_eq!(switched, truth.angle_rad >= 0.1, "at {} rad", truth.angle_rad);
        on += u64::from(switched);
        let index = feedback.validity & validity::INDEX != 0;
        let (from, to) = (pair[0].plant.truth.angle_rad, truth.angle_rad);
        assert_eq!(index, (from - 0.25) * (to - 0.25) < 0.0, "from {from} to {to} rad");
        passed += u64::from(index);
        assert_ne!(feedback.validity & validity::HOMED, 0);
    }
    assert_eq!(passed, 2, "there and back");
    assert!(on > 100 && on < messages.len() as u64 - 100);
}

#[test]
fn the_truth_has_what_loads_the_spool_beside_friction() {
    let (scenario, mut truth) = (steps(), Valve::default().model());
    assert!(run(&scenario, &truth).iter().all(|cycle| cycle.plant.truth.other_torque_nm == 0.0));
    let cos = [("cos", EffectValue::List(vec![0.3]))];
    truth.effects.push(Effect::from_parts("position-torque", &cos).unwrap());
    let messages = run(&scenario, &truth);
    let last = &messages.last().unwrap().plant.truth;
    let wanted_nm = 0.3 * last.angle_rad.cos();
    assert!((last.other_torque_nm - wanted_nm).abs() < 1e-3, "{} N·m, not {wanted_nm}", last.other_torque_nm);
}

#[test]
fn the_truth_has_the_encoders_zero() {
    let mut parts = wire(&steps(), &Valve::default().model(), &Valve::default().model()).unwrap();
    parts.plant.start.encoder_zero_rad = 0.01;
    for cycle in InProcess::new(&parts).take(50) {
        let (feedback, truth) = (cycle.plant.feedback, cycle.plant.truth);
        assert_eq!(truth.encoder_zero_rad, 0.01);
        assert!((feedback.angle_rad - truth.angle_rad - 0.01).abs() < 2e-4);
    }
}

#[test]
fn a_process_that_takes_over_begins_where_the_one_before_left_the_drive() {
    let feedback = Feedback {
        accepted_microsteps: 1234,
        validity: validity::ENERGISED | validity::HOMED | validity::ENCODER,
        zero_id: 7,
        ..Feedback::default()
    };
    let truth = PlantTruth {
        angle_rad: 0.2,
        command_angle_rad: 1000.0 * 6e-5,
        encoder_zero_rad: 0.003,
        ..PlantTruth::default()
    };
    let start = PlantStart::left_by(&feedback, &truth, 6e-5, false);
    assert_eq!((start.angle_rad, start.count_microsteps, start.rebased_microsteps), (0.2, 1234, 234));
    assert_eq!((start.encoder_zero_rad, start.homed, start.energised, start.zero_id), (0.003, true, true, 7));
    for (energised, absolute, homed) in [(true, false, true), (false, false, false), (false, true, true)] {
        let validity = validity::HOMED | if energised { validity::ENERGISED } else { 0 };
        let start = PlantStart::left_by(&Feedback { validity, ..feedback }, &truth, 6e-5, absolute);
        assert_eq!((start.homed, start.encoder_zero_rad), (homed, 0.0));
    }
}

#[test]
fn the_guard_has_the_following_error_or_a_quarter_pitch_to_spare() {
    let quarter_rad = TAU / 50.0 / 4.0;
    for (following_rad, slack_rad) in [(0.01, quarter_rad), (0.2, 0.2)] {
        let mut scenario = steps();
        scenario.safety.max_following_error_rad = following_rad;
        (scenario.limits.min_angle_rad, scenario.limits.max_angle_rad) = (Some(-0.5), Some(0.9));
        let rig = Valve::default().model();
        let drive = wire(&scenario, &rig, &rig).unwrap().plant.drive;
        assert!((drive.lowest_angle_rad.unwrap() + 0.5 + slack_rad).abs() < 1e-12);
        assert!((drive.highest_angle_rad.unwrap() - 0.9 - slack_rad).abs() < 1e-12);
    }
}

#[test]
fn the_way_to_neutral_is_in_microsteps() {
    let mut scenario = steps();
    scenario.driver.after_stop = config::AfterStop::Neutral { angle_rad: 0.1, speed_rad_per_s: 0.5 };
    (scenario.limits.min_angle_rad, scenario.limits.max_angle_rad) = (Some(-0.5), Some(0.9));
    let rig = Valve::default().model();
    let microstep_rad = TAU / 500.0 / 225.0;
    let AfterStop::Neutral { microsteps, pulse_rate_hz, longest_way } =
        wire(&scenario, &rig, &rig).unwrap().plant.drive.after_stop
    else {
        panic!("neutral expected");
    };
    assert_eq!(microsteps, (0.1 / microstep_rad).round() as i64);
    assert!((pulse_rate_hz - 0.5 / microstep_rad).abs() < 1e-6);
    assert_eq!(longest_way, (2.0 * 0.8 / microstep_rad).ceil());
}

#[test]
fn a_measured_run_says_what_stopped_it_and_nothing_where_nothing_did() {
    let rig = Valve::default().model();
    let scenario = steps();
    let outcome = measure(&scenario, &rig, &rig, Level::FULL).unwrap();
    assert_eq!((outcome.fault, outcome.lost_teeth), (None, 0));
    assert!(outcome.cycles > 900 && outcome.cycles <= 1001, "{}", outcome.cycles);
    let stuck = Valve { coulomb_torque_nm: 20.0, static_torque_nm: 20.0, ..Valve::default() }.model();
    let mut tight = scenario;
    tight.safety.max_following_error_rad = 0.02;
    let outcome = measure(&tight, &stuck, &rig, Level::OBSERVED).unwrap();
    assert_eq!(outcome.fault, Some(FaultCode::FollowingError));
}

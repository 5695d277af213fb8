//! What is fed forward, by the arithmetic of the law and not by the code's; what limits it; what the observer adds.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use approx::assert_relative_eq;
use common::{Bench, HOLDS, MOTOR, order, params};
use signals::{
    ControlParameter, OperatorCommand, OperatorKind, OperatorResult, Reference, limiting, validity,
};
use step_control::{Compensation, ObserverSettings, Params};

const TEETH: f64 = 50.0;
const ENCODER: u64 = HOLDS | validity::ENCODER;

fn wide(compensation: Compensation) -> Params {
    let mut params = Params { compensation, max_following_error_rad: 10.0, ..params() };
    // Out of the way: one cycle's change of the lead is what is looked at.
    params.drive.max_pulse_acceleration_hz_per_s = 1e12;
    params
}

/// The command's lead over the reference, rad, one cycle after this reference.
fn lead_rad(params: Params, reference: Reference) -> f64 {
    let mut bench = Bench::running(params);
    bench.reference = Some(reference);
    let command = bench.step(None).command;
    command.position_unrounded * MOTOR.microstep_angle_rad() - reference.angle_rad
}

fn lead_of(torque_nm: f64) -> f64 {
    (torque_nm / MOTOR.holding_torque_nm).asin() / TEETH
}

fn moving(speed_rad_per_s: f64, acceleration_rad_per_s2: f64) -> Reference {
    Reference { angle_rad: 1e-3, speed_rad_per_s, acceleration_rad_per_s2, ..Reference::default() }
}

#[test]
fn inertia_and_the_motors_damping_are_led_exactly() {
    let mut params = wide(Compensation::CoulombViscous);
    (params.coulomb_torque_nm, params.viscous_nm_s_per_rad) = (0.0, 0.0);
    for (speed, acceleration) in [(0.0, 1000.0), (0.0, -1000.0), (5.0, 0.0), (-5.0, 300.0)] {
        let torque_nm = params.inertia_kg_m2 * acceleration + MOTOR.damping_nm_s_per_rad * speed;
        let found = lead_rad(params.clone(), moving(speed, acceleration));
        assert_relative_eq!(found, lead_of(torque_nm), max_relative = 1e-9);
    }
}

#[test]
fn coulomb_and_viscous_friction_are_led_by_speed_and_fade_at_rest() {
    let mut params = wide(Compensation::CoulombViscous);
    (params.coulomb_torque_nm, params.viscous_nm_s_per_rad) = (1.2, 0.05);
    for (speed, part) in [(0.0, 0.0), (0.01, 0.5), (-0.01, -0.5), (0.02, 1.0), (5.0, 1.0), (-5.0, -1.0)] {
        let torque_nm = part * 1.2 + (0.05 + MOTOR.damping_nm_s_per_rad) * speed;
        let found = lead_rad(params.clone(), moving(speed, 0.0));
        assert_relative_eq!(found, lead_of(torque_nm), max_relative = 1e-9, epsilon = 1e-15);
    }
}

#[test]
fn without_compensation_the_command_is_the_reference() {
    assert_eq!(lead_rad(wide(Compensation::None), moving(5.0, 1000.0)), 0.0);
}

#[test]
fn a_second_cycle_of_delay_is_led_by_the_motion_at_its_jerk() {
    let reference = Reference {
        angle_rad: 1e-3,
        speed_rad_per_s: 2.0,
        acceleration_rad_per_s2: 300.0,
        jerk_rad_per_s3: 4e4,
        ..Reference::default()
    };
    let params = Params { loop_delay_cycles: 2, ..wide(Compensation::None) };
    let way_rad = 2.0 * 1e-3 + 300.0 * 1e-6 / 2.0 + 4e4 * 1e-9 / 6.0;
    assert_relative_eq!(lead_rad(params, reference), way_rad, max_relative = 1e-9);
}

#[test]
fn the_lead_ends_at_70_degrees_and_says_so() {
    let mut params = wide(Compensation::CoulombViscous);
    params.coulomb_torque_nm = 5.9;
    let mut bench = Bench::running(params);
    bench.reference = Some(moving(1.0, 0.0));
    let status = bench.step(None).status;
    assert_relative_eq!(status.lead_angle_rad.to_degrees(), 70.0, max_relative = 1e-9);
    assert_eq!(status.limiting & limiting::TORQUE, limiting::TORQUE);
    let needed_nm = 5.9 + (MOTOR.damping_nm_s_per_rad + bench.params.viscous_nm_s_per_rad) * 1.0;
    assert_relative_eq!(status.torque_reserve_nm, MOTOR.holding_torque_nm - needed_nm, max_relative = 1e-9);
}

fn observed(limit_nm: f64) -> Params {
    wide(Compensation::Full).with_observer(ObserverSettings {
        bandwidth_hz: 100.0,
        torque_limit_nm: limit_nm,
        count_rad: 1e-5,
        noise_rad: 1e-5,
        delay_cycles: 0,
        damps: true,
    })
}

#[test]
fn the_observer_adds_no_more_than_its_limit_and_says_when_it_does() {
    // A rotor that turns 3 mrad behind its reference takes more than any limit in the end; one that follows takes nothing.
    for (limit_nm, behind_rad, saturates) in [(0.5, 3e-3, true), (0.5, 0.0, false)] {
        let mut bench = Bench::new(observed(limit_nm));
        bench.validity = ENCODER;
        bench.step(Some(order(1, OperatorKind::Arm)));
        let mut limited = false;
        for _ in 0..200 {
            bench.rotor_rad = -behind_rad;
            let status = bench.step(None).status;
            limited |= status.limiting & limiting::OBSERVER != 0;
            // What it adds to damp the resonance comes on top, within the same again.
            assert!(status.disturbance_estimate_nm.abs() <= 2.0 * limit_nm, "{status:?}");
        }
        assert_eq!(limited, saturates, "limit {limit_nm} N·m");
    }
}

fn set(parameter: ControlParameter, value: f64) -> OperatorCommand {
    let kind = OperatorKind::SetParameter.code();
    OperatorCommand { parameter: parameter.code(), value, kind, ..order(2, OperatorKind::SetParameter) }
}

#[test]
fn parameters_change_within_their_ranges_alone() {
    use ControlParameter::{
        CompensationLevel, FollowingErrorPerSpeed, MaxFollowingError, None as Nothing, ObserverBandwidth,
        ObserverLimit,
    };
    let cases = [
        (Nothing, 1.0, false),
        (CompensationLevel, 0.0, true),
        (CompensationLevel, 3.0, true),
        (CompensationLevel, 4.0, false),
        (CompensationLevel, 1.5, false),
        (ObserverBandwidth, 0.1, true),
        (ObserverBandwidth, 0.09, false),
        (ObserverBandwidth, 1000.0, true),
        (ObserverBandwidth, 1001.0, false),
        (ObserverLimit, 6.0, true),
        (ObserverLimit, 6.1, false),
        (ObserverLimit, -0.1, false),
        (MaxFollowingError, 0.01, true),
        (MaxFollowingError, 0.0, false),
        (MaxFollowingError, 0.06, false),
        (FollowingErrorPerSpeed, 0.0, true),
        (FollowingErrorPerSpeed, 0.3, false),
        (FollowingErrorPerSpeed, f64::NAN, false),
    ];
    for (parameter, value, taken) in cases {
        let params =
            Params { max_following_error_rad: 0.05, following_error_per_speed_s: 0.2, ..observed(3.0) };
        let mut bench = Bench::new(params);
        let status = bench.step(Some(set(parameter, value))).status;
        let expected = if taken { OperatorResult::Done } else { OperatorResult::Refused };
        assert_eq!(status.operator_result, expected.code(), "{parameter} = {value}");
    }
    for parameter in [ObserverBandwidth, ObserverLimit] {
        let status = Bench::new(params()).step(Some(set(parameter, 1.0))).status;
        assert_eq!(status.operator_result, OperatorResult::Refused.code(), "{parameter} without an observer");
    }
}

#[test]
fn a_level_set_while_it_runs_counts_from_the_next_command_on() {
    let mut params = wide(Compensation::CoulombViscous);
    (params.coulomb_torque_nm, params.viscous_nm_s_per_rad) = (1.2, 0.0);
    let mut bench = Bench::running(params);
    bench.reference = Some(moving(1.0, 0.0));
    assert!(bench.step(None).status.friction_estimate_nm > 1.1);
    let status = bench.step(Some(set(ControlParameter::CompensationLevel, 0.0))).status;
    assert_eq!(status.friction_estimate_nm, 0.0);
}

//! The motor's numbers: lag, lost steps, resonance, torque against speed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use common::*;
use valve_model::*;

#[test]
fn steps_of_the_design() {
    assert!((motor().microstep_angle_rad() - 0.0032_f64.to_radians()).abs() < 1e-12);
    assert!((motor().tooth_pitch_rad() - 7.2_f64.to_radians()).abs() < 1e-12);
    let (lead, saturated) = motor().lead_for_torque(2.0);
    assert!(!saturated && ((lead / 50.0).to_degrees() - 0.39).abs() < 0.001);
    assert!(((lead / 50.0) / motor().microstep_angle_rad() - 122.0).abs() < 0.5);
    assert_eq!(motor().lead_for_torque(-7.0), (-FRAC_PI_2, true));
    assert_eq!(motor().lead_for_torque(f64::NAN), (0.0, true));
    assert_eq!(motor().lost_steps(0.5, 0.5 - 2.1 * motor().tooth_pitch_rad()), 2);
    assert_eq!(motor().lost_steps(f64::NAN, 0.0), 0);
}

/// A valve almost without friction, or with bristles of 1000 N·m/rad that never break.
fn valve(static_nm: f64) -> ValveParams {
    let friction = LuGreParams {
        coulomb_torque_nm: static_nm,
        static_torque_nm: static_nm,
        bristle_damping_nm_s_per_rad: 0.0,
        viscous_nm_s_per_rad: 0.0,
        ..soft()
    };
    let mut model = model(FrictionParams::LuGre(friction));
    model.motor = Some(MotorParams { damping_nm_s_per_rad: 0.001, ..motor() });
    ValveParams::new(&model).unwrap()
}

/// The frequency in Hz of small oscillations about the angle where the motor stands against a constant torque.
fn resonance(valve: &ValveParams, lead_rad: f64, nudge_rad: f64) -> f64 {
    let mut state = ValveState::at_rest(nudge_rad);
    let (mut crossings, mut before) = (Vec::new(), 0.0);
    for k in 0..20_000 {
        step(valve, &mut state, &input(lead_rad, lead_rad), 1e-4);
        let speed = state.speed_rad_per_s;
        if before < 0.0 && speed >= 0.0 {
            crossings.push(1e-4 * (f64::from(k) + before / (before - speed)));
        }
        before = speed;
    }
    (crossings.len() - 1) as f64 / (crossings[crossings.len() - 1] - crossings[0])
}

#[test]
fn the_resonance_is_where_it_should_be() {
    let sliding = resonance(&valve(1e-6), 0.0, 1e-4);
    assert!((sliding - 123.3).abs() < 0.2, "{sliding} Hz in sliding");
    let resting = resonance(&valve(1e3), 0.0, 1e-4);
    assert!((resting - 256.6).abs() < 0.4, "{resting} Hz at rest");
}

#[test]
fn the_resonance_falls_with_the_load_angle() {
    // A constant torque on the spool: pressure torque.
    let torque_nm = 4.5;
    let mut model = model(FrictionParams::Dahl(DahlParams {
        coulomb_torque_nm: 1e-6,
        viscous_nm_s_per_rad: 0.0,
        ..dahl(1.0)
    }));
    model.motor = Some(MotorParams { damping_nm_s_per_rad: 0.001, ..motor() });
    model.effects =
        vec![Effect::from_parts("pressure-torque", &[("gain", EffectValue::Number(torque_nm))]).unwrap()];
    let valve = ValveParams::new(&model).unwrap();
    let load_angle = (torque_nm / 6.0_f64).asin();
    let mut state = ValveState::at_rest(-load_angle / 50.0 + 2e-4);
    let at_pressure = ValveInput { pressure_drop_pa: 1e6, ..input(0.0, 0.0) };
    let mut crossings = Vec::new();
    let mut before = 0.0;
    for k in 0..20_000 {
        step(&valve, &mut state, &at_pressure, 1e-4);
        let speed = state.speed_rad_per_s;
        if before < 0.0 && speed >= 0.0 {
            crossings.push(1e-4 * (f64::from(k) + before / (before - speed)));
        }
        before = speed;
    }
    let hertz = (crossings.len() - 1) as f64 / (crossings[crossings.len() - 1] - crossings[0]);
    let expected = 123.28 * load_angle.cos().sqrt();
    assert!((hertz - expected).abs() < 0.3, "{hertz} Hz, not {expected}");
}

#[test]
fn too_much_lag_loses_a_step() {
    let valve = ValveParams::new(&model(FrictionParams::LuGre(soft()))).unwrap();
    let mut state = ValveState::at_rest(0.0);
    // The command leaps by 0.6 of a tooth pitch: the nearer rest position is the next tooth's.
    let target = 0.6 * motor().tooth_pitch_rad();
    for _ in 0..1000 {
        step(&valve, &mut state, &input(target, target), 1e-3);
    }
    assert_eq!(motor().lost_steps(target, state.angle_rad), 1);
    let pitches = (target - state.angle_rad) / motor().tooth_pitch_rad();
    assert!((pitches - 1.0).abs() < 0.15, "{pitches}");
}

fn electrical() -> MotorParams {
    MotorParams {
        supply_voltage_v: Some(30.0),
        phase_resistance_ohm: Some(0.8),
        phase_inductance_h: Some(12e-3),
        rated_current_a: Some(5.0),
        torque_constant_nm_per_a: Some(0.5),
        ..motor()
    }
}

#[test]
fn torque_falls_with_speed() {
    let motor = electrical();
    assert_eq!(motor.validate(), Ok(()));
    assert_eq!(motor.available_torque_nm(0.0), 6.0);
    // By the formula at one speed beyond the corner: (R·I + E)² + X²·I² = V².
    let speed = 20.0;
    let current = motor.available_torque_nm(speed) / 6.0 * 5.0;
    assert!(current < 5.0);
    let volts = (0.8 * current + 0.5 * speed).hypot(50.0 * speed * 12e-3 * current);
    assert!((volts - 30.0).abs() < 1e-9, "{volts} V");
    assert_eq!(motor.available_torque_nm(-speed), motor.available_torque_nm(speed));
    assert_eq!(motor.available_torque_nm(120.0), 0.0);

    let pull_out = motor.pull_out_speed_rad_per_s(3.0).unwrap();
    let held = motor.available_torque_nm(pull_out) - 0.02 * pull_out;
    assert!((held - 3.0).abs() < 1e-6, "{held} N·m at {pull_out} rad/s");
    assert_eq!(motor.pull_out_speed_rad_per_s(6.1), None);
    assert!((common::motor().pull_out_speed_rad_per_s(1.5).unwrap() - 33.51).abs() < 0.01);
}

/// The lag of the shaft behind a command that has run at a speed for a while, in tooth pitches.
fn lag_at(motor: MotorParams, speed: f64) -> f64 {
    let mut model = model(FrictionParams::LuGre(soft()));
    model.motor = Some(motor);
    let valve = ValveParams::new(&model).unwrap();
    let mut state = ValveState::at_rest(0.0);
    let mut command = 0.0;
    for k in 0..3000 {
        let next = command + 1e-3 * speed * (f64::from(k) / 2000.0).min(1.0);
        step(&valve, &mut state, &input(command, next), 1e-3);
        command = next;
    }
    (command - state.angle_rad) / motor.tooth_pitch_rad()
}

#[test]
fn beyond_the_pull_out_speed_the_motor_stalls() {
    let motor = electrical();
    let pull_out = motor.pull_out_speed_rad_per_s(1.5).unwrap();
    assert!(pull_out > 20.0 && pull_out < 30.0, "{pull_out}");
    assert!(lag_at(motor, 0.9 * pull_out).abs() < 0.25, "{}", lag_at(motor, 0.9 * pull_out));
    assert!(lag_at(motor, 1.1 * pull_out) > 2.0, "{}", lag_at(motor, 1.1 * pull_out));
    assert!(lag_at(common::motor(), 1.1 * pull_out).abs() < 0.25, "without the electrical keys it holds");
}

#[test]
fn impossible_motors_are_refused() {
    let key = |motor: MotorParams| motor.validate().unwrap_err().key;
    assert_eq!(key(MotorParams { rotor_inertia_kg_m2: 0.0, ..motor() }), "rotor_inertia_kg_m2");
    assert_eq!(key(MotorParams { full_steps_per_rev: 400, ..motor() }), "full_steps_per_rev");
    assert_eq!(key(MotorParams { holding_torque_nm: f64::NAN, ..motor() }), "holding_torque_nm");
    assert_eq!(key(MotorParams { rated_current_a: None, ..electrical() }), "rated_current_a");
    assert_eq!(key(MotorParams { supply_voltage_v: Some(2.0), ..electrical() }), "supply_voltage_v");
}

#[test]
fn the_orifice_and_its_inverse() {
    let orifice = OrificeParams {
        discharge_coefficient: 0.65,
        window_area_m2: 8.75e-5,
        closed_angle_rad: 0.1,
        open_angle_rad: 0.1 + PI / 4.0,
        window: Window::Linear,
    };
    assert_eq!(orifice.validate(), Ok(()));
    let full = orifice.flow_m3_per_s(2.0, 5e6, 853.0);
    assert!((full - 0.65 * 8.75e-5 * (1e7_f64 / 853.0).sqrt()).abs() < 1e-15);
    for (flow, pressure) in [(0.3 * full, 5e6), (-0.7 * full, -5e6), (full, 5e6)] {
        let angle = orifice.angle_for_flow(flow, pressure, 853.0).unwrap();
        assert!((orifice.flow_m3_per_s(angle, pressure, 853.0) - flow).abs() < 1e-15);
        assert!((orifice.angle_for_opening(orifice.opening(angle)) - angle).abs() < 1e-12);
    }
    assert_eq!(orifice.angle_for_flow(0.0, 0.0, 853.0), Ok(0.1));
    assert!(matches!(orifice.angle_for_flow(1.01 * full, 5e6, 853.0), Err(OrificeError::TooMuch { .. })));
    let against = orifice.angle_for_flow(-full, 5e6, 853.0);
    assert!(matches!(against, Err(OrificeError::AgainstPressure { .. })));
    assert!(matches!(orifice.angle_for_flow(f64::NAN, 5e6, 853.0), Err(OrificeError::NotANumber { .. })));
    assert_eq!(orifice.flow_m3_per_s(0.05, 5e6, 853.0), 0.0);
    assert!(orifice.opening(TAU) == 1.0);
}

#[test]
fn a_window_of_any_shape_has_an_inverse() {
    let table = WindowTable::new(&[(0.0, 0.0), (0.3, 0.05), (0.6, 0.7), (1.0, 1.0)]).unwrap();
    for window in [Window::Linear, Window::Round, Window::Table(table)] {
        let mut last = -1.0;
        for part in (0..=1000).map(|k| f64::from(k) / 1000.0) {
            let area = window.area(part);
            assert!(area > last && (window.way(area) - part).abs() < 1e-9, "{window:?} at {part}: {area}");
            assert!((window.area(window.way(part)) - part).abs() < 1e-9, "{window:?} at {part}");
            last = area;
        }
        assert_eq!((window.area(-1.0), window.area(0.0)), (0.0, 0.0));
        assert_eq!((window.area(1.0), window.area(2.0)), (1.0, 1.0));
    }
    // A quarter of the way: a segment of 60 degrees to either side.
    let segment = (PI / 3.0 - (PI / 3.0).sin() * (PI / 3.0).cos()) / PI;
    assert!((Window::Round.area(0.25) - segment).abs() < 1e-15);
    assert!((Window::Table(table).area(0.45) - 0.375).abs() < 1e-15);
}

#[test]
fn a_window_table_must_rise_from_closed_to_open() {
    let found = |points: &[(f64, f64)]| WindowTable::new(points).unwrap_err();
    assert_eq!(found(&[(0.0, 0.0)]).found, "1 points");
    assert!(found(&[(0.0, 0.1), (1.0, 1.0)]).expected.contains("from [0, 0]"));
    assert!(found(&[(0.0, 0.0), (0.5, f64::NAN), (1.0, 1.0)]).expected.contains("rise"));
    assert!(found(&[(0.0, 0.0), (0.5, 0.3), (0.6, 0.3), (1.0, 1.0)]).expected.contains("rise"));
    assert!(WindowTable::new(&[(0.0, 0.0); 17]).is_err());
}

//! What looks like a mistake of a record and is none, and what is worth a note alone.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::{Channel, Log};
use log_quality::{Kind, Severity, inspect, untold};
use std::f64::consts::TAU;
use valve_model::{FrictionParams, Model, MotorParams};

mod common;
use common::*;

/// A temperature that rises beside a torque that holds looks like a motion one way with friction against it.
#[test]
fn a_run_at_rest_beside_a_warming_oil_is_no_exchange() {
    let mut log = log();
    let (mut noise, run) = (noise(), &mut log.runs[2]);
    run.angle_rad = run.time_s.iter().map(|_| (0.3 * noise()).round() * 1e-5).collect();
    run.torque_nm = Some(run.time_s.iter().map(|_| 1.6 + 0.01 * noise()).collect());
    run.oil_temperature_c = Some(run.time_s.iter().map(|t| 40.0 + 0.8 * (t - run.time_s[0])).collect());
    let found = inspect(&log, Some(&model()));
    assert!(found.iter().all(|finding| finding.severity != Severity::Mistake), "{found:#?}");
}

/// So many in one run that their steps are no rare ones there.
#[test]
fn many_wild_samples_of_one_run_are_noted() {
    let mut log = log();
    let torque = log.runs[3].torque_nm.as_mut().unwrap();
    torque.iter_mut().skip(40).step_by(71).for_each(|torque| *torque += 6.0);
    let found = inspect(&log, Some(&model()));
    assert_eq!(found.len(), 1, "{found:#?}");
    let noted = named(&found, Kind::Outliers);
    assert!(noted.evidence.starts_with("28 sample(s) of torque"), "{}", noted.evidence);
}

#[test]
fn what_is_too_short_or_has_nothing_to_predict_is_no_good_log() {
    let mut log = log();
    drain(&mut log.runs[2], 12..2000);
    let found = inspect(&log, Some(&model()));
    let short = named(&found, Kind::TooShort);
    assert!(short.evidence.contains("in run run 2: run 2 has 12"), "{}", short.evidence);
    log.runs.iter_mut().for_each(|run| run.torque_nm = None);
    let found = inspect(&log, Some(&model()));
    assert_eq!(named(&found, Kind::NothingToPredict).severity, Severity::Note);
}

#[test]
fn friction_that_is_several_times_the_models_is_no_mistake_of_the_record() {
    for factor in [0.14, 0.2, 0.5, 0.7, 1.5, 2.0, 5.0, 7.0] {
        let mut log = log();
        scale(&mut log, Channel::Torque, factor);
        assert_eq!(inspect(&log, Some(&model())), [], "{factor}");
    }
    let mut log = log();
    log.runs.iter_mut().flat_map(|run| run.torque_nm.as_mut().unwrap()).for_each(|torque| *torque += 3.0);
    assert_eq!(inspect(&log, Some(&model())), [], "an offset of twice the friction");
}

/// A coupling that rings for 20 ms when a run begins rules the run's RMS; in degrees the contact would not have settled before it ends, but
/// the samples after it agree as they are.
#[test]
fn a_start_that_rings_is_no_mistake_of_a_unit() {
    let (mut log, model) = (log(), model());
    let run = log.runs.first_mut().unwrap();
    let speed = |row: usize| if row < 1000 { 10.0 } else { 0.0 };
    run.angle_rad = (0..2000).map(|row| 1e-3 * 10.0 * row.min(1000) as f64).collect();
    let torque = |row: usize| model.friction.steady_torque(speed(row));
    let rings = |row: usize| if row < 20 { 50.0 * (row as f64).cos() } else { 0.0 };
    let mut noise = noise();
    run.torque_nm = Some((0..2000).map(|row| torque(row) + rings(row) + 0.01 * noise()).collect());
    let claims: Vec<_> = inspect(&log, Some(&model))
        .into_iter()
        .filter(|finding| finding.severity == Severity::Mistake)
        .collect();
    assert_eq!(claims, []);
}

/// A motor that lags behind its command by 1.5 N·m's worth of friction.
fn with_a_motor() -> Model {
    let motor = MotorParams {
        phases: 2,
        rotor_teeth: 50,
        full_steps_per_rev: 200,
        microsteps_per_full_step: 256,
        holding_torque_nm: 3.0,
        rotor_inertia_kg_m2: 1e-4,
        damping_nm_s_per_rad: 0.01,
        max_pulse_rate_hz: 1e6,
        supply_voltage_v: None,
        phase_resistance_ohm: None,
        phase_inductance_h: None,
        rated_current_a: None,
        torque_constant_nm_per_a: None,
    };
    Model { motor: Some(motor), ..model() }
}

/// Friction may hold a rotor back to a sixth of a command smaller than 90° electrical either way: that is no unit. A larger command is.
#[test]
fn a_rotor_held_back_is_no_mistake_of_a_unit() {
    let model = with_a_motor();
    for (amplitude_rad, is_claimed) in [(0.006, false), (0.06, true)] {
        let mut log = log();
        for (index, run) in log.runs.iter_mut().enumerate() {
            run.torque_nm = None;
            let size = if index == 2 { amplitude_rad } else { 0.5 };
            let part = if index == 2 { 1.0 / TAU } else { 1.0 };
            let most = run.angle_rad.iter().fold(0.0_f64, |most, angle| most.max(angle.abs()));
            let command: Vec<f64> = run.angle_rad.iter().map(|angle| size * angle / most).collect();
            run.angle_rad = command.iter().map(|command| part * command).collect();
            run.angle_command_rad = Some(command);
        }
        let found = inspect(&log, Some(&model));
        let claimed = found.iter().any(|finding| finding.kind == Kind::RunsDiffer);
        assert_eq!(claimed, is_claimed, "a command of {amplitude_rad} rad: {found:#?}");
    }
}

#[test]
fn without_a_model_a_torque_that_drives_is_seen() {
    let mut log = log();
    scale(&mut log, Channel::Torque, -1.0);
    assert_eq!(named(&inspect(&log, None), Kind::TorqueSign).severity, Severity::Mistake);
}

/// A zero that drifts by a tenth of the friction over the record is noted; one that only scatters from run to run is not.
#[test]
fn a_zero_that_drifts_is_noted() {
    let zeros = |zero: fn(f64) -> f64| {
        let mut log = log();
        let end = log.runs.last().unwrap().end_s();
        for run in &mut log.runs {
            let parts: Vec<f64> = run.time_s.iter().map(|time| zero(time / end)).collect();
            run.torque_nm.as_mut().unwrap().iter_mut().zip(&parts).for_each(|(torque, zero)| *torque += zero);
        }
        inspect(&log, Some(&model()))
    };
    let found = zeros(|part| 0.2 * part);
    let drift = named(&found, Kind::ZeroDrift);
    assert_eq!((drift.severity, drift.place.channels.as_slice()), (Severity::Note, &["torque"][..]));
    assert!(drift.evidence.contains("moves with time"), "{}", drift.evidence);
    assert_eq!(zeros(|part| 0.2 * (40.0 * part).sin()), []);
}

/// A filter of 30 Hz on a torque sampled at 1 kHz is noted, with about its bandwidth.
#[test]
fn a_transducer_slower_than_its_record_is_noted() {
    let filtered = |hertz: f64| {
        let mut log = log();
        for run in &mut log.runs {
            let part = 1.0 - (-TAU * hertz * 1e-3).exp();
            let mut state = run.torque_nm.as_ref().unwrap()[0];
            for torque in run.torque_nm.as_mut().unwrap() {
                state += part * (*torque - state);
                *torque = state;
            }
        }
        inspect(&log, Some(&model()))
    };
    let found = filtered(30.0);
    let evidence = &named(&found, Kind::Bandwidth).evidence;
    let told = evidence.split("of about ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    assert!((10.0..90.0).contains(&told.parse().unwrap()), "{evidence}");
    assert_eq!(filtered(400.0), []);
}

/// A mark for missing samples that import was not told of is no unit, and hides no sign that is turned.
#[test]
fn a_mark_for_missing_samples_is_told_as_such() {
    let mut log = log();
    scale(&mut log, Channel::Torque, -1.0);
    for run in &mut log.runs {
        run.torque_nm.as_mut().unwrap().iter_mut().skip(50).step_by(211).for_each(|torque| *torque = -9999.0);
    }
    let found = inspect(&log, Some(&model()));
    assert_eq!(named(&found, Kind::TorqueSign).severity, Severity::Mistake);
    let mark = named(&found, Kind::Outliers);
    assert!(mark.mend.contains("one value"), "{}", mark.mend);
    assert!(found.iter().all(|of| matches!(of.kind, Kind::TorqueSign | Kind::Outliers)), "{found:?}");
}

/// A torque that goes by the pressure moves with time where the pressure does, and is no drift.
#[test]
fn a_torque_by_the_pressure_is_no_drift() {
    let mut log = log();
    for (number, run) in log.runs.iter_mut().enumerate() {
        let pressure_pa = 1e5 * number as f64;
        run.pressure_drop_pa = Some(vec![pressure_pa; run.len()]);
        run.torque_nm.as_mut().unwrap().iter_mut().for_each(|torque| *torque += 1e-6 * pressure_pa);
    }
    let found = inspect(&log, Some(&model()));
    assert!(found.iter().all(|of| of.kind != Kind::ZeroDrift), "{found:?}");
}

/// The lag tells angle and command apart only where little else is between them. But a command is computed, and an encoder scatters.
#[test]
fn an_angle_exchanged_with_its_command_is_told_by_their_noise_where_the_lag_is_not_clear() {
    let model = with_a_motor();
    let lag_rad = (1.5_f64 / 3.0).asin() / 50.0;
    // How eccentric the encoder is, rad; its noise; the command's microstep.
    let cases = [
        (0.0, 1e-5, 0.0, Some("angle_command exchanged the error")),
        (0.0, 0.0, 0.0, Some("angle_command exchanged the error")),
        (3.0 * lag_rad, 1e-5, 0.0, Some("scatters by 1")),
        (3.0 * lag_rad, 0.0, TAU / 51_200.0, None),
    ];
    for (eccentric_rad, noise_rad, step_rad, claimed) in cases {
        for exchanged in [false, true] {
            let mut log = log();
            let mut noise = noise();
            for run in &mut log.runs {
                run.torque_nm = None;
                let commanded = std::mem::take(&mut run.angle_rad);
                let smooth: Vec<f64> = commanded.iter().enumerate().map(|(row, _)| smooth(row)).collect();
                let speed = |row: usize| 1e3 * (smooth[(row + 1).min(1999)] - smooth[row]);
                let lag = |row: usize| -lag_rad * (speed(row) / 0.5).tanh();
                run.angle_rad = (0..2000)
                    .map(|row| {
                        smooth[row]
                            + lag(row)
                            + eccentric_rad * (smooth[row] + 1.0).cos()
                            + noise_rad * noise()
                    })
                    .collect();
                let stepped =
                    |angle: f64| if step_rad > 0.0 { (angle / step_rad).round() * step_rad } else { angle };
                run.angle_command_rad = Some(smooth.into_iter().map(stepped).collect());
                if exchanged {
                    exchange(run, Channel::Angle, Channel::AngleCommand);
                }
            }
            let found = inspect(&log, Some(&model));
            let of = found.iter().find(|finding| finding.kind == Kind::SwappedChannels);
            let what = format!("eccentric {eccentric_rad}, noise {noise_rad}, step {step_rad}, {exchanged}");
            match claimed.filter(|_| exchanged) {
                Some(says) => assert!(of.unwrap().evidence.contains(says), "{what}: {of:?}"),
                None => assert!(of.is_none(), "{what}: {of:?}"),
            }
        }
    }
}

/// A sine of 1 Hz at 1 kHz over half a turn.
fn smooth(row: usize) -> f64 {
    1.5 * (TAU * 1e-3 * row as f64).sin()
}

/// A creep test, sampled at 5 Hz, agrees with the model as it is, or nearly so.
#[test]
fn a_record_that_is_slow_is_no_mistake_of_the_clock() {
    let model = model();
    for factor in [0.9, 1.0, 1.1] {
        let mut log = log();
        let mut noise = noise();
        for run in &mut log.runs {
            run.time_s.iter_mut().for_each(|time_s| *time_s *= 200.0);
            let speed = |row: usize| {
                let (one, other) = (row.saturating_sub(1), (row + 1).min(1999));
                (run.angle_rad[other] - run.angle_rad[one]) / (run.time_s[other] - run.time_s[one])
            };
            let torque = |row| factor * model.friction.steady_torque(speed(row)) + 0.01 * noise();
            run.torque_nm = Some((0..2000).map(torque).collect());
        }
        let found = inspect(&log, Some(&model));
        assert!(found.iter().all(|of| of.kind != Kind::TimeUnit), "{factor}: {found:?}");
    }
}

/// A valve that is closed lets nothing through, for as long as it is: the product's own recordings have no noise of the flow.
#[test]
fn a_flow_of_none_is_no_rail() {
    let mut log = log();
    for run in &mut log.runs {
        let flow = run.time_s.iter().map(|time_s| (3.0 * time_s).sin().max(0.0) * 1e-3);
        run.flow_m3_per_s = Some(flow.collect());
    }
    let clipped = |log: &Log| inspect(log, Some(&model())).iter().any(|of| of.kind == Kind::Clipped);
    assert!(!clipped(&log));
    // One that ends at some other flow is a meter's end.
    for run in &mut log.runs {
        let flow = run.time_s.iter().map(|time_s| (2.0 + (3.0 * time_s).sin()).min(2.6) * 1e-3);
        run.flow_m3_per_s = Some(flow.collect());
    }
    assert!(clipped(&log));
}

/// Coulomb friction is the same at any speed: a log of it alone agrees in degrees and in milliseconds too.
#[test]
fn units_that_the_model_does_not_tell_are_said_to_be_that() {
    assert_eq!(untold(&log(), &model()), []);
    let mut coulomb = model();
    coulomb.load = None;
    if let FrictionParams::LuGre(friction) = &mut coulomb.friction {
        friction.viscous_nm_s_per_rad = 0.0;
        friction.static_torque_nm = friction.coulomb_torque_nm;
    }
    let mut noise = noise();
    let mut log = log();
    for run in &mut log.runs {
        let speeds = run.angle_rad.windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<_>>();
        for (torque_nm, speed) in run.torque_nm.iter_mut().flatten().zip(&speeds) {
            *torque_nm = 1.5 * speed.signum() + 0.01 * noise();
        }
    }
    assert_eq!(untold(&log, &coulomb), [Channel::Angle, Channel::Time]);
}

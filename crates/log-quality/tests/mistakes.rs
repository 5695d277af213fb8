//! Every kind of finding, made on purpose in a record that has none.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::{Channel, Log, Run};
use log_quality::{Finding, Kind, Severity, inspect};
use std::f64::consts::TAU;
use valve_model::{FrictionParams, LoadParams, LuGreParams, Model, MotorParams};

fn model() -> Model {
    let friction = FrictionParams::LuGre(LuGreParams {
        coulomb_torque_nm: 1.5,
        static_torque_nm: 2.0,
        stribeck_velocity_rad_per_s: 0.05,
        stribeck_exponent: 2.0,
        bristle_stiffness_nm_per_rad: 1000.0,
        bristle_damping_nm_s_per_rad: 1.0,
        viscous_nm_s_per_rad: 0.05,
    });
    Model {
        name: "test".to_owned(),
        motor: None,
        load: Some(LoadParams { inertia_kg_m2: 4e-4 }),
        friction,
        orifice: None,
        oil: None,
        clearance: None,
        seals: None,
        effects: Vec::new(),
    }
}

/// Noise of deviation 1, the same every time.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 88_172_645_463_325_252_u64;
    move || {
        let mut uniform = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// Slow and fast sines of 2 s at 1 kHz, torque by the steady curve, at three pressures.
fn log() -> Log {
    let mut noise = noise();
    let model = model();
    let runs = (0..6).map(|index| {
        let (hz, speed) = (0.5 + 0.25 * f64::from(index), 1.0 + f64::from(index));
        let time_s: Vec<f64> = (0..2000).map(|row| 10.0 * f64::from(index) + 1e-3 * f64::from(row)).collect();
        let w = TAU * hz;
        let phase = |t: &f64| w * (t - 10.0 * f64::from(index));
        let torque = |t: &f64| {
            let (speed_now, acceleration) = (speed * phase(t).cos(), -speed * w * phase(t).sin());
            model.friction.steady_torque(speed_now) + 4e-4 * acceleration
        };
        Run {
            name: format!("run {index}"),
            angle_rad: time_s
                .iter()
                .map(|t| ((speed / w * phase(t).sin() + 1e-5 * noise()) / 1e-5).round() * 1e-5)
                .collect(),
            torque_nm: Some(time_s.iter().map(|t| torque(t) + 0.01 * noise()).collect()),
            pressure_drop_pa: Some(
                time_s.iter().map(|_| 1e6 * f64::from(1 + index % 3) + 500.0 * noise()).collect(),
            ),
            oil_temperature_c: Some(vec![40.0; 2000]),
            time_s,
            ..Run::default()
        }
    });
    Log { title: "test".to_owned(), runs: runs.collect(), ..Log::default() }
}

fn scale(log: &mut Log, channel: Channel, factor: f64) {
    for run in &mut log.runs {
        let mut values = run.take_channel(channel).unwrap();
        values.iter_mut().for_each(|value| *value *= factor);
        run.set_channel(channel, values);
    }
}

fn exchange(run: &mut Run, one: Channel, other: Channel) {
    let (first, second) = (run.take_channel(one).unwrap(), run.take_channel(other).unwrap());
    run.set_channel(one, second);
    run.set_channel(other, first);
}

fn drain(run: &mut Run, rows: std::ops::Range<usize>) {
    for channel in Channel::ALL {
        if let Some(mut values) = run.take_channel(*channel) {
            values.drain(rows.clone());
            run.set_channel(*channel, values);
        }
    }
}

fn named(found: &[Finding], kind: Kind) -> &Finding {
    found.iter().find(|finding| finding.kind == kind).unwrap_or_else(|| panic!("no {kind:?}: {found:#?}"))
}

#[test]
fn nothing_is_claimed_of_a_record_without_mistakes() {
    assert_eq!(inspect(&log(), Some(&model())), []);
    assert_eq!(inspect(&log(), None), []);
}

type Case = (&'static str, fn(&mut Log), Kind, &'static str);

#[test]
fn each_mistake_is_named_with_what_speaks_for_it() {
    let cases: &[Case] = &[
        (
            "noise",
            |log| {
                let mut noise = noise();
                log.runs.iter_mut().for_each(|run| run.angle_rad.fill_with(&mut noise));
            },
            Kind::WrongAngle,
            "jumps from each sample",
        ),
        (
            "turns",
            |log| {
                log.runs.iter_mut().for_each(|run| run.angle_command_rad = Some(run.angle_rad.clone()));
                scale(log, Channel::Angle, 1.0 / TAU);
            },
            Kind::AngleUnit,
            "divided by 6.28",
        ),
        ("sign", |log| scale(log, Channel::Torque, -1.0), Kind::TorqueSign, "falls from"),
        ("direction", |log| scale(log, Channel::Angle, -1.0), Kind::TorqueSign, "the torque's sign turned"),
        ("degrees", |log| scale(log, Channel::Angle, 57.295_78), Kind::AngleUnit, "57.3"),
        (
            "degrees and N cm",
            |log| {
                scale(log, Channel::Angle, 57.295_78);
                scale(log, Channel::Torque, 100.0);
            },
            Kind::TorqueUnit,
            "divided by 100 and the angle by 57.3",
        ),
        ("N cm", |log| scale(log, Channel::Torque, 100.0), Kind::TorqueUnit, "divided by 100 "),
        ("a decimal too many", |log| scale(log, Channel::Torque, 10.0), Kind::TorqueUnit, "divided by 10 "),
        ("a decimal too few", |log| scale(log, Channel::Torque, 0.1), Kind::TorqueUnit, "times 10 "),
        (
            "mN m turned",
            |log| scale(log, Channel::Torque, -1000.0),
            Kind::TorqueUnit,
            "1000, and its sign turned",
        ),
        ("ms", |log| scale(log, Channel::Time, 1000.0), Kind::TimeUnit, "1000"),
        ("bar", |log| scale(log, Channel::PressureDrop, 1e-5), Kind::PressureUnit, "hundredth of a bar"),
        (
            "torque and angle exchanged",
            |log| log.runs.iter_mut().for_each(|run| exchange(run, Channel::Torque, Channel::Angle)),
            Kind::SwappedChannels,
            "angle and torque exchanged",
        ),
        (
            "torque and pressure exchanged",
            |log| log.runs.iter_mut().for_each(|run| exchange(run, Channel::Torque, Channel::PressureDrop)),
            Kind::SwappedChannels,
            "torque and pressure_drop exchanged",
        ),
        (
            "temperature and pressure exchanged",
            |log| {
                log.runs
                    .iter_mut()
                    .for_each(|run| exchange(run, Channel::OilTemperature, Channel::PressureDrop))
            },
            Kind::SwappedChannels,
            "oil_temperature",
        ),
        (
            "torque and angle exchanged in half of the runs",
            |log| {
                log.runs[3..].iter_mut().for_each(|run| exchange(run, Channel::Torque, Channel::Angle));
            },
            Kind::SwappedChannels,
            "angle and torque exchanged in runs run 3, run 4, run 5",
        ),
        (
            "the speed for the angle",
            |log| {
                for run in &mut log.runs {
                    let steps = run.angle_rad.windows(2).map(|pair| (pair[1] - pair[0]) / 1e-3);
                    let mut speed: Vec<f64> = steps.collect();
                    speed.push(0.0);
                    run.angle_rad = speed;
                }
            },
            Kind::WrongAngle,
            "integrated",
        ),
        (
            "the time for the angle",
            |log| log.runs.iter_mut().for_each(|run| run.angle_rad = run.time_s.clone()),
            Kind::WrongAngle,
            "grows with the time",
        ),
        (
            "clipped at both rails for most of the time",
            |log| {
                for torque in log.runs.iter_mut().map(|run| run.torque_nm.as_mut().unwrap()) {
                    // A transducer that takes some samples to turn.
                    let means =
                        torque.windows(5).map(|five| (five.iter().sum::<f64>() / 5.0).clamp(-1.4, 1.4));
                    let means: Vec<f64> = means.collect();
                    torque[..means.len()].copy_from_slice(&means);
                    torque[means.len()..].fill(1.4);
                }
            },
            Kind::Clipped,
            "ends at",
        ),
        (
            "clipped",
            |log| {
                for torque in log.runs.iter_mut().flat_map(|run| run.torque_nm.as_mut().unwrap()) {
                    *torque = torque.clamp(-1.6, 1.55);
                }
            },
            Kind::Clipped,
            "exactly that",
        ),
        ("rows lost", |log| drain(&mut log.runs[2], 100..130), Kind::Gaps, "between rows 100 and 101"),
        (
            "doubled",
            |log| {
                for run in &mut log.runs {
                    for values in [&mut run.angle_rad, run.torque_nm.as_mut().unwrap()] {
                        (0..values.len()).for_each(|row| values[row] = values[row - row % 3]);
                    }
                }
            },
            Kind::DoubledSamples,
            "3 times as fast",
        ),
        (
            "two runs in N cm",
            |log| {
                for run in &mut log.runs[1..3] {
                    run.torque_nm.as_mut().unwrap().iter_mut().for_each(|torque| *torque *= 100.0);
                }
            },
            Kind::RunsDiffer,
            "in runs run 1, run 2",
        ),
        (
            "one run in ms",
            |log| log.runs[5].time_s.iter_mut().for_each(|time| *time *= 1000.0),
            Kind::RunsDiffer,
            "interval",
        ),
        (
            "one run in bar",
            |log| log.runs[1].pressure_drop_pa.as_mut().unwrap().iter_mut().for_each(|p| *p *= 1e-5),
            Kind::RunsDiffer,
            "hydraulic circuit",
        ),
        (
            "the torque is always the same",
            |log| log.runs.iter_mut().for_each(|run| run.torque_nm = Some(vec![1.0; 2000])),
            Kind::ConstantChannel,
            "torque never changes",
        ),
    ];
    for (what, make, kind, says) in cases {
        let mut log = log();
        make(&mut log);
        let found = inspect(&log, Some(&model()));
        println!("{what}: {found:#?}");
        let finding = named(&found, *kind);
        assert_eq!(finding.severity, Severity::Mistake, "{what}");
        assert!(finding.evidence.contains(says), "{what}: {}", finding.evidence);
        let mut claims = found.iter().filter(|finding| finding.severity == Severity::Mistake);
        assert!(claims.all(|finding| finding.kind == *kind), "{what}: {found:#?}");
    }
}

#[test]
fn what_one_must_know_is_noted_with_its_place() {
    let mut log = log();
    log.runs[3].torque_nm.as_mut().unwrap()[700] = 25.0;
    log.runs[4].torque_nm.as_mut().unwrap()[10..15].fill(f64::NAN);
    log.runs[1].pressure_drop_pa = None;
    let found = inspect(&log, Some(&model()));
    assert!(found.iter().all(|finding| finding.severity == Severity::Note), "{found:#?}");
    assert_eq!(named(&found, Kind::Outliers).place.rows, Some((701, 701)));
    let missing = named(&found, Kind::MissingSamples);
    assert!(
        missing.evidence.contains("5 samples of torque") && missing.evidence.contains("row 11"),
        "{missing:?}"
    );
    assert_eq!(named(&found, Kind::MissingChannel).place.runs, ["run 1"]);
}

/// So many in one run that their steps are no rare ones there.
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

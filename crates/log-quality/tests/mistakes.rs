//! Every kind of finding, made on purpose in a record that has none.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::{Channel, Log};
use log_quality::{Kind, Severity, inspect};
use std::f64::consts::TAU;

mod common;
use common::*;

#[test]
fn nothing_is_claimed_of_a_record_without_mistakes() {
    assert_eq!(inspect(&log(), Some(&model())), []);
    assert_eq!(inspect(&log(), None), []);
}

/// A magnet's torque over the angle may be several times the friction.
#[test]
fn a_large_torque_over_the_angle_is_no_wrong_angle() {
    let mut log = log();
    for run in &mut log.runs {
        let torques = run.torque_nm.iter_mut().flatten();
        torques.zip(&run.angle_rad).for_each(|(torque, angle)| *torque += 12.0 * (50.0 * angle).sin());
    }
    let mistakes: Vec<Kind> = inspect(&log, Some(&model())).into_iter().map(|of| of.kind).collect();
    assert!(!mistakes.contains(&Kind::WrongAngle), "{mistakes:?}");
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
            "the angle of another record",
            |log| {
                for run in &mut log.runs {
                    run.angle_rad = run.time_s.iter().map(|at| 0.2 * (TAU * 4.3 * at).sin()).collect();
                }
            },
            Kind::WrongAngle,
            "has nothing to do with the motion",
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

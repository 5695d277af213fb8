//! The planned motions beside those of the official ruckig library (C++, through its Python package).
//!
//! Runs where Python has the package (`test_needs::python`).
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use common::{PERIOD_S, Rig, set_point};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use signals::{Reference, SetPointKind};
use test_needs::python;
use trajectory::Limits;

const SAMPLES: usize = 20;

/// A motion from rest, and another one from the middle of it.
#[derive(Debug, Clone)]
struct Problem {
    limits: Limits,
    first_rad: f64,
    then_rad: f64,
    after: usize,
    stride: usize,
}

fn problems() -> impl Strategy<Value = Problem> {
    let limits = (0.0..1.6_f64, 1.0..4.0_f64, 3.0..6.5_f64).prop_map(|(v, a, j)| Limits {
        min_angle_rad: None,
        max_angle_rad: None,
        max_speed_rad_per_s: 10_f64.powf(v),
        max_acceleration_rad_per_s2: 10_f64.powf(a),
        max_jerk_rad_per_s3: 10_f64.powf(j),
        unhomed_speed_rad_per_s: 0.2,
    });
    (limits, -6.0..6.0_f64, -6.0..6.0_f64, 0..300_usize, 1..30_usize).prop_map(
        |(limits, first_rad, then_rad, after, stride)| Problem { limits, first_rad, then_rad, after, stride },
    )
}

/// Our samples of the second motion, the state it starts from, and the number of cycles until it rests.
fn ours(problem: &Problem) -> (Reference, Vec<Reference>, u64) {
    let mut rig = Rig::running(problem.limits, 0.0);
    let mut from = rig.set(&set_point(1, SetPointKind::Angle, problem.first_rad));
    for _ in 0..problem.after {
        from = rig.cycle();
    }
    let mut next = rig.set(&set_point(2, SetPointKind::Angle, problem.then_rad));
    let mut samples = Vec::new();
    let mut cycles = 1;
    let mut rests_after = (next.moving == 0).then_some(1);
    while rests_after.is_none() || samples.len() < SAMPLES {
        if (cycles as usize).is_multiple_of(problem.stride) && samples.len() < SAMPLES {
            samples.push(next);
        }
        next = rig.cycle();
        cycles += 1;
        if next.moving == 0 && rests_after.is_none() {
            rests_after = Some(cycles);
        }
    }
    (from, samples, rests_after.unwrap())
}

fn theirs(python: &Path, input: &str) -> Vec<Vec<f64>> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tools/ruckig_oracle.py");
    let mut child = Command::new(python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python starts");
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_owned();
    let writer = std::thread::spawn(move || stdin.write_all(input.as_bytes()).unwrap());
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|line| line.split(',').map(|word| word.parse().unwrap()).collect()).collect()
}

#[test]
fn motions_are_those_of_the_official_library() {
    let Some(python) = python(&["ruckig"]) else { return };
    let mut runner = TestRunner::default();
    let problems: Vec<Problem> =
        (0..1000).map(|_| problems().new_tree(&mut runner).unwrap().current()).collect();
    let solved: Vec<_> = problems.iter().map(ours).collect();
    let mut input = String::new();
    for (problem, (from, ..)) in problems.iter().zip(&solved) {
        let limits = &problem.limits;
        let interval_s = problem.stride as f64 * PERIOD_S;
        // From a state on the way to the speed limit the library takes a slow detour when rounding puts that state a
        // bit beyond it.
        let v = limits.max_speed_rad_per_s * (1.0 + 1e-10);
        let (a, j) = (limits.max_acceleration_rad_per_s2, limits.max_jerk_rad_per_s3);
        let Reference { angle_rad, speed_rad_per_s, acceleration_rad_per_s2, .. } = from;
        let target_rad = problem.then_rad;
        writeln!(
            input,
            "{angle_rad:?},{speed_rad_per_s:?},{acceleration_rad_per_s2:?},{target_rad:?},{v:?},{a:?},{j:?},{interval_s:?},{SAMPLES}"
        )
        .unwrap();
    }
    let rows = theirs(&python, &input);
    assert_eq!(rows.len(), problems.len());
    let mut worst = 0.0_f64;
    let mut unsolved = 0;
    for ((problem, (from, samples, cycles)), row) in problems.iter().zip(&solved).zip(&rows) {
        if row[0].is_nan() {
            unsolved += 1;
            continue;
        }
        let late_s = *cycles as f64 * PERIOD_S - row[0];
        assert!(
            (-1e-7..PERIOD_S + 1e-7).contains(&late_s),
            "duration: {late_s} s late; {problem:?} {from:?}"
        );
        let limits = &problem.limits;
        for (sample, theirs) in samples.iter().zip(row[1..].chunks(3)) {
            let errors = [
                (sample.angle_rad - theirs[0]) / 6.0,
                (sample.speed_rad_per_s - theirs[1]) / limits.max_speed_rad_per_s,
                (sample.acceleration_rad_per_s2 - theirs[2]) / limits.max_acceleration_rad_per_s2,
            ];
            for error in errors {
                worst = worst.max(error.abs());
                assert!(error.abs() < 1e-6, "{errors:?}: {problem:?} {from:?} {sample:?} {theirs:?}");
            }
        }
    }
    println!("{} problems, {unsolved} unsolved by the library, worst difference {worst:.1e}", rows.len());
    assert!(unsolved < 10);
}

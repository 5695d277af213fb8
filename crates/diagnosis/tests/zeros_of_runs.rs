//! A torque whose zero differs from run to run, beside a pressure that was set for each run or an offset of all: what is a zero and what is a cause.
#![allow(clippy::indexing_slicing)]

mod drive;

use diagnosis::{Diagnosis, Verdict};
use drive::{diagnosed, names, run, sine};
use log_data::Run;
use std::f64::consts::TAU;
use valve_model::EffectId;

/// Zeros drawn once, of mean zero and a scatter of one: no two alike, and more of one sign at each pressure than of the other.
const DRAWN: [f64; 8] = [0.9, -1.1, 0.6, -1.4, 1.2, -0.7, 1.3, -0.8];

/// A run of sines both ways, at a pressure of its own and with this torque more.
fn swings(number: usize, pressure_pa: f64, more_nm: f64) -> Run {
    let rate = TAU * [0.3, 0.5, 0.8][number % 3];
    let mut run = run(number, 2000, &sine(rate, 2.0), |_| more_nm);
    run.pressure_drop_pa = Some(vec![pressure_pa; run.time_s.len()]);
    run
}

/// Runs at 1 and 7 MPa in turns, with a torque of the pressure and zeros of their own.
fn at_two_pressures(runs: usize, by_pressure_nm: f64, zeros_nm: f64) -> Diagnosis {
    let run = |number: usize| {
        let high = number.is_multiple_of(2);
        let zero = zeros_nm * DRAWN[number % DRAWN.len()] * if number % 4 < 2 { 1.0 } else { -1.0 };
        swings(number, if high { 7e6 } else { 1e6 }, zero + if high { by_pressure_nm } else { 0.0 })
    };
    diagnosed((0..runs).map(run).collect())
}

#[test]
fn a_torque_by_the_pressure_of_each_run_must_be_more_than_their_zeros() {
    // Runs, the torque that pressure makes and the zeros' scatter, N·m; whether pressure is named.
    for (runs, by_pressure_nm, zeros_nm, expected) in [
        (2, 0.0, 0.0, false),
        (2, 0.0, 0.02, false),
        (4, 0.0, 0.02, false),
        (8, 0.0, 0.02, false),
        // Far beyond what a zero is off by.
        (4, 0.4, 0.02, true),
        (8, 0.2, 0.02, true),
        (8, 0.2, 0.0, true),
    ] {
        let found = at_two_pressures(runs, by_pressure_nm, zeros_nm);
        let named = names(&found, EffectId::PressureTorque);
        let causes: Vec<_> = found.causes.iter().map(|cause| cause.id.name()).collect();
        println!("{runs} runs, {by_pressure_nm} and {zeros_nm} N·m: {:?} {causes:?}", found.verdict);
        assert_eq!(named, expected, "{runs} runs, {by_pressure_nm} and {zeros_nm} N·m: {causes:?}");
        assert!(expected || found.causes.is_empty(), "{causes:?}");
    }
}

/// Eight runs of sines both ways with zeros of their own and an offset.
fn with_offset(zeros_nm: f64, offset_nm: f64) -> Diagnosis {
    let swing = |number: usize| {
        let motion = sine(TAU * [0.3, 0.5, 0.8, 1.1][number % 4], 2.0 + 0.5 * (number % 3) as f64);
        run(number, 1000, &motion, |_| zeros_nm * DRAWN[number] + offset_nm)
    };
    diagnosed((0..8).map(swing).collect())
}

#[test]
fn a_common_offset_is_no_zero_of_each_run() {
    for (offset_nm, expected) in [(0.15, true), (-0.15, true), (0.02, false), (0.0, false)] {
        let found = with_offset(0.02, offset_nm);
        let named =
            [EffectId::TorqueOffset, EffectId::DirectionAsymmetry].iter().any(|id| names(&found, *id));
        assert_eq!(named, expected, "{offset_nm} N·m: {:?}", found.verdict);
        assert_eq!(
            found.verdict == Verdict::NoDiscrepancy,
            !expected,
            "{offset_nm} N·m: {:?}",
            found.verdict
        );
    }
}

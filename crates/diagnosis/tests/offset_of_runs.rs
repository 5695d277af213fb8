//! A common offset of a torque whose zero differs from run to run as well.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod drive;

use diagnosis::{Diagnosis, Verdict};
use drive::{diagnosed, names, run, sine};
use std::f64::consts::TAU;
use valve_model::EffectId;

/// Eight runs of sines both ways with this torque more, by the run's number.
fn found(more_nm: impl Fn(usize) -> f64) -> Diagnosis {
    let swing = |number: usize| {
        let motion = sine(TAU * [0.3, 0.5, 0.8, 1.1][number % 4], 2.0 + 0.5 * (number % 3) as f64);
        run(number, 1000, &motion, |_| more_nm(number))
    };
    diagnosed((0..8).map(swing).collect())
}

/// Zeros that scatter by 0.02 N·m about none.
fn zero_nm(number: usize) -> f64 {
    0.02 * [0.9, -1.1, 0.6, -1.4, 1.2, -0.7, 1.3, -0.8][number % 8]
}

#[test]
fn a_common_offset_is_no_zero_of_each_run() {
    for (offset_nm, expected) in [(0.15, true), (-0.15, true), (0.02, false), (0.0, false)] {
        let found = found(|number| zero_nm(number) + offset_nm);
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

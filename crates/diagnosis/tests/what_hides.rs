//! Causes that hid behind something else: behind zeros of each run, behind the noise's colour, beside a larger cause.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

mod drive;

use diagnosis::{Diagnosis, Verdict};
use drive::{diagnosed, names, run, sine};
use std::f64::consts::TAU;
use valve_model::EffectId;

/// Eight runs of sines both ways with this torque more, by the run's number, and angle, speed and acceleration.
fn found(more: impl Fn(usize, [f64; 3]) -> f64) -> Diagnosis {
    let swing = |number: usize| {
        let motion = sine(TAU * [0.3, 0.5, 0.8, 1.1][number % 4], 2.0 + 0.5 * (number % 3) as f64);
        run(number, 1000, &motion, |state| more(number, state))
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
        let found = found(|number, _| zero_nm(number) + offset_nm);
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

#[test]
fn a_torque_by_the_angle_is_no_zero_of_each_run() {
    let found = found(|number, [angle, ..]| zero_nm(number) + 0.06 * angle);
    let named = names(&found, EffectId::PositionTorque) || !found.unnamed.is_empty();
    assert!(named, "{:?}: {:?}", found.verdict, found.within_tolerance);
}

#[test]
fn a_gears_ripple_is_no_colour_of_the_noise() {
    for size_nm in [0.03, 0.1] {
        let found = found(|_, [angle, ..]| size_nm * (2.37 * angle + 0.5).sin());
        let law = found.unnamed.first().map(|law| law.kind);
        println!("{size_nm} N·m: {:?}, {law:?}", found.verdict);
        assert_ne!(found.verdict, Verdict::NoDiscrepancy, "{size_nm} N·m");
    }
}

#[test]
fn an_inertia_is_seen_beside_a_larger_torque_over_the_angle() {
    let inertia = 1e-3;
    for part in [0.0, 0.5] {
        let found =
            found(|_, [angle, _, acceleration]| 0.3 * (7.0 * angle).sin() + part * inertia * acceleration);
        assert!(names(&found, EffectId::PositionTorque), "{:?}", found.verdict);
        assert_eq!(names(&found, EffectId::LoadInertia), part > 0.0, "{part}: {:?}", found.within_tolerance);
    }
}

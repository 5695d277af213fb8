//! A torque whose zero differs from run to run, beside a pressure that was set for each run: what is a zero and what is a cause.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

use diagnosis::{Diagnosis, OneAfterTheOther, Options, diagnose};
use log_data::{Log, Run};
use prediction::{Past, predict};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;
use valve_model::{EffectId, FrictionParams, LoadParams, Model, StribeckParams};

const COULOMB_NM: f64 = 1.0;
const NOISE_NM: f64 = 0.01;
const STEP_S: f64 = 5e-3;
/// Standard deviation of the nominal numbers, and of a torque's zero relative to the friction.
const TOLERANCE: f64 = 0.03;

fn model() -> Model {
    let friction = StribeckParams {
        coulomb_torque_nm: COULOMB_NM,
        static_torque_nm: COULOMB_NM,
        stribeck_velocity_rad_per_s: 0.1,
        stribeck_exponent: 2.0,
        regularisation_velocity_rad_per_s: 0.05,
        viscous_nm_s_per_rad: 0.01,
    };
    Model {
        motor: None,
        load: Some(LoadParams { inertia_kg_m2: 1e-3 }),
        friction: FrictionParams::Stribeck(friction),
        effects: Vec::new(),
        ..Model::bench_rig()
    }
}

/// A run of sines both ways, at a pressure of its own and with this torque more.
fn run(number: usize, pressure_pa: f64, more_nm: f64) -> Run {
    let mut random = Pcg64Mcg::seed_from_u64(number as u64 + 1);
    let noise = Normal::new(0.0, NOISE_NM).unwrap();
    let samples = 2000;
    let rate = TAU * [0.3, 0.5, 0.8][number % 3];
    let angle = |k: usize| 2.0 * (rate * STEP_S * k as f64).sin();
    let mut run = Run {
        name: format!("{number}"),
        time_s: (0..samples).map(|k| 100.0 * number as f64 + STEP_S * k as f64).collect(),
        angle_rad: (0..samples).map(angle).collect(),
        torque_nm: Some(vec![0.0; samples]),
        pressure_drop_pa: Some(vec![pressure_pa; samples]),
        ..Run::default()
    };
    predict(&mut run, &model(), &Past::default()).unwrap();
    run.torque_nm.iter_mut().flatten().for_each(|torque| *torque += more_nm + noise.sample(&mut random));
    run
}

fn is_named(found: &Diagnosis, id: EffectId) -> bool {
    found.causes.iter().any(|cause| cause.id == id)
        || found.ambiguous.iter().any(|group| group.ids.contains(&id))
}

/// Runs at 1 and 7 MPa in turns, with a torque of the pressure and zeros of their own.
fn diagnosed(runs: usize, by_pressure_nm: f64, zeros_nm: f64) -> Diagnosis {
    // Drawn once, of mean zero and the scatter asked for: no two alike, and more of one sign at each pressure than of the other.
    let drawn = [0.9, -1.1, 0.6, -1.4, 1.2, -0.7, 1.3, -0.8];
    let run = |number: usize| {
        let high = number.is_multiple_of(2);
        let zero = zeros_nm * drawn[number % drawn.len()] * if number % 4 < 2 { 1.0 } else { -1.0 };
        run(number, if high { 7e6 } else { 1e6 }, zero + if high { by_pressure_nm } else { 0.0 })
    };
    let log = Log { runs: (0..runs).map(run).collect(), ..Log::default() };
    let options = Options { tolerance: TOLERANCE, ..Options::default() };
    diagnose(&log, &model(), &options, &OneAfterTheOther, &mut |_| {}).unwrap().diagnosis
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
        let found = diagnosed(runs, by_pressure_nm, zeros_nm);
        let named = is_named(&found, EffectId::PressureTorque);
        let causes: Vec<_> = found.causes.iter().map(|cause| cause.id.name()).collect();
        println!("{runs} runs, {by_pressure_nm} and {zeros_nm} N·m: {:?} {causes:?}", found.verdict);
        assert_eq!(named, expected, "{runs} runs, {by_pressure_nm} and {zeros_nm} N·m: {causes:?}");
        assert!(expected || found.causes.is_empty(), "{causes:?}");
    }
}

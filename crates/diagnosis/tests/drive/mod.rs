//! A drive with one level of friction, viscous friction and inertia: its runs, and what a diagnosis finds in them.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

use diagnosis::{Diagnosis, OneAfterTheOther, Options, diagnose};
use log_data::{Log, Run};
use prediction::{Past, predict};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;
use valve_model::{EffectId, FrictionParams, LoadParams, Model, StribeckParams};

const COULOMB_NM: f64 = 1.0;
pub const VISCOUS: f64 = 0.01;
const INERTIA: f64 = 1e-3;
const NOISE_NM: f64 = 0.01;
const STEP_S: f64 = 5e-3;

/// A drive with one level of friction, viscous friction and inertia.
fn model() -> Model {
    let friction = StribeckParams {
        coulomb_torque_nm: COULOMB_NM,
        static_torque_nm: COULOMB_NM,
        stribeck_velocity_rad_per_s: 0.1,
        stribeck_exponent: 2.0,
        regularisation_velocity_rad_per_s: 0.05,
        viscous_nm_s_per_rad: VISCOUS,
    };
    Model {
        motor: None,
        load: Some(LoadParams { inertia_kg_m2: INERTIA }),
        friction: FrictionParams::Stribeck(friction),
        effects: Vec::new(),
        ..Model::bench_rig()
    }
}

/// Angle, speed and acceleration at a time.
pub type Motion = Box<dyn Fn(f64) -> [f64; 3]>;

/// A sine of this angular frequency and amplitude, rad/s and rad.
pub fn sine(rate: f64, size: f64) -> Motion {
    Box::new(move |at| {
        let (sin, cos) = (rate * at).sin_cos();
        [size * sin, size * rate * cos, -size * rate * rate * sin]
    })
}

/// A run of a motion whose torque is the model's and `more`, with noise.
pub fn run(number: usize, samples: usize, motion: &Motion, more: impl Fn([f64; 3]) -> f64) -> Run {
    let mut random = Pcg64Mcg::seed_from_u64(number as u64 + 1);
    let noise = Normal::new(0.0, NOISE_NM).unwrap();
    let begin_s = 100.0 * number as f64;
    let times = (0..samples).map(|k| STEP_S * k as f64);
    let states: Vec<[f64; 3]> = times.clone().map(motion).collect();
    let mut run = Run {
        name: format!("{number}"),
        time_s: times.map(|at| begin_s + at).collect(),
        torque_nm: Some(vec![0.0; samples]),
        angle_rad: states.iter().map(|state| state[0]).collect(),
        ..Run::default()
    };
    predict(&mut run, &model(), &Past::default()).unwrap();
    for (torque, state) in run.torque_nm.iter_mut().flatten().zip(&states) {
        *torque += more(*state) + noise.sample(&mut random);
    }
    run
}

/// What is found in runs of the drive.
pub fn diagnosed(runs: Vec<Run>) -> Diagnosis {
    let log = Log { runs, ..Log::default() };
    let options = Options { tolerance: 0.03, ..Options::default() };
    diagnose(&log, &model(), &options, &OneAfterTheOther, &mut |_| {}).unwrap().diagnosis
}

/// Whether a cause is named, by itself or in a group.
pub fn names(found: &Diagnosis, id: EffectId) -> bool {
    found.causes.iter().any(|cause| cause.id == id)
        || found.ambiguous.iter().any(|group| group.ids.contains(&id))
}

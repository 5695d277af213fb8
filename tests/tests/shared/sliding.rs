//! Runs at constant speeds and pressures, measured with noise; their diagnosis, and its page in a browser.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    missing_docs,
    dead_code
)]

use log_data::{Log, Run};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;
use std::path::{Path, PathBuf};
use std::process::Command;
use stepvalve_tests::{Finished, TestPlace, repository};
use test_needs::python_with_browser;

const STEP_RAD: f64 = std::f64::consts::TAU / 8_388_608.0;
pub const NOISE_NM: f64 = 0.01;

pub fn rig() -> PathBuf {
    repository().join("rt-config/models/rig.toml")
}

pub fn diagnose(place: &TestPlace, log: &Path, model: &Path, out: &str) -> Finished {
    let out = place.path(out);
    let arguments = ["diagnose", "--log", log.to_str().unwrap(), "--model", model.to_str().unwrap()];
    place.stepvalve(&[&arguments[..], &["--out", out.to_str().unwrap()]].concat())
}

/// A run at 1 kHz that slides all the time: T = ±T_c·(1 + gain·p) + σ2·ω, measured with noise.
pub fn sliding(name: &str, number: u64, speed: f64, pressure_mpa: f64, gain: f64) -> Run {
    let mut random = Pcg64Mcg::seed_from_u64(number);
    let noise = Normal::new(0.0, NOISE_NM).unwrap();
    let time_s: Vec<f64> = (0..1000).map(|k| 10.0 * number as f64 + 1e-3 * f64::from(k)).collect();
    let angle_rad = (0..1000).map(|k| (1e-3 * f64::from(k) * speed / STEP_RAD).round() * STEP_RAD).collect();
    let torque = (1.5 * (1.0 + gain * pressure_mpa)).copysign(speed) + 2e-4 * speed;
    let torque_nm = Some(time_s.iter().map(|_| torque + noise.sample(&mut random)).collect());
    let pressure_drop_pa = Some(vec![1e6 * pressure_mpa; 1000]);
    Run {
        name: name.to_owned(),
        kind: "constant-velocity".to_owned(),
        time_s,
        angle_rad,
        torque_nm,
        pressure_drop_pa,
        ..Run::default()
    }
}

/// Four speeds both ways at four pressures.
pub fn campaign(gain: f64) -> Vec<Run> {
    let mut runs = Vec::new();
    for speed in [0.5, -0.9, 2.0, -4.0, 0.7, -0.6] {
        for pressure_mpa in [0.0, 4.0, 9.0, 15.0] {
            let number = runs.len() as u64;
            runs.push(sliding(&format!("run-{number:02}"), number, speed, pressure_mpa, gain));
        }
    }
    runs
}

pub fn write(place: &TestPlace, name: &str, runs: Vec<Run>) -> PathBuf {
    let path = place.path(name);
    let log = Log { title: "test".to_owned(), runs, ..Log::default() };
    run_log::write_log(&path, &log).unwrap();
    path
}

pub fn json(place: &TestPlace, out: &str) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(place.path(out).join("diagnosis.json")).unwrap()).unwrap()
}

/// A headless Chromium shows the page, and its console stays empty.
pub fn look_at(page: &Path, says: &str) {
    let Some(python) = python_with_browser() else { return };
    let script = repository().join("tests/browser/test_diagnosis_page.py");
    let output = Command::new(python).arg(script).arg(page).arg(says).output().unwrap();
    print!("{}", Finished::from(output).expect_code(0).stdout);
}

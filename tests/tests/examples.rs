//! The examples that CONTRIBUTING.md shows do what they say.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::process::Command;
use stepvalve_tests::{Finished, repository};

/// An example of a crate, built and ready for arguments.
fn example(package: &str, name: &str) -> Command {
    let mut command = Command::new(env!("CARGO"));
    command.args(["run", "--quiet", "--locked", "--package", package, "--example", name, "--"]);
    command.current_dir(repository());
    command
}

#[test]
fn a_scenario_is_simulated_in_process() {
    let mut command = example("closed-loop", "simulate_scenario");
    let output = command.arg("rt-config/scenarios/sine-1hz.toml").output().unwrap();
    let finished = Finished::from(output).expect_code(0);
    let mut lines = finished.stdout.lines();
    assert!(lines.next().unwrap().starts_with("time_s,angle_rad,"));
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|value| value.parse().unwrap()).collect()).collect();
    // A sine of 0.2 rad: the true angle reaches it, and the encoder's is never far from it.
    let largest = rows.iter().map(|row| row[2].abs()).fold(0.0, f64::max);
    assert!((largest - 0.2).abs() < 1e-3, "{largest}");
    assert!(rows.iter().all(|row| (row[1] - row[2]).abs() < 1e-3));
    assert!(finished.stderr.contains("largest following error"), "{}", finished.stderr);
}

#[test]
fn a_scenario_that_is_not_there_is_named() {
    let output = example("closed-loop", "simulate_scenario").arg("nowhere.toml").output().unwrap();
    let finished = Finished::from(output);
    assert_ne!(finished.code, Some(0));
    assert!(finished.stderr.contains("nowhere.toml"), "{}", finished.stderr);
}

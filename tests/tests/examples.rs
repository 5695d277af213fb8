//! The examples that CONTRIBUTING.md shows do what they say.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use stepvalve_tests::{Finished, TestPlace, repository};

/// An example, as it was built beside the programs, in the repository's folder.
fn example(place: &TestPlace, name: &str) -> Command {
    let mut command = place.command(&format!("examples/{name}"));
    command.current_dir(repository());
    command
}

#[test]
fn a_scenario_is_simulated_in_process() {
    let place = TestPlace::new();
    let output =
        example(&place, "simulate_scenario").arg("rt-config/scenarios/sine-1hz.toml").output().unwrap();
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
    let place = TestPlace::new();
    let output = example(&place, "simulate_scenario").arg("nowhere.toml").output().unwrap();
    let finished = Finished::from(output);
    assert_ne!(finished.code, Some(0));
    assert!(finished.stderr.contains("nowhere.toml"), "{}", finished.stderr);
}

#[test]
fn a_bus_client_follows_an_instance_to_its_end() {
    let place = TestPlace::new();
    let scenario = place.scenario("step-sequence.toml", &[("silence_cycles", "silence_cycles = 500")]);
    let mut run = place.command("stepvalve");
    run.args(["run", "--instance", "watched", "--record", "none", "--out"]).arg(place.path("out"));
    let mut run = run.arg(&scenario).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    place.wait_for("the instance", || {
        (place.stepvalve(&["status", "--instance", "watched"]).code == Some(0)).then_some(())
    });
    let mut client = example(&place, "print_feedback");
    let mut client = client.arg("watched").stdout(Stdio::piped()).spawn().unwrap();
    let mut said = BufReader::new(client.stdout.take().unwrap());
    let mut cycles = Vec::new();
    for _ in 0..5 {
        let mut line = String::new();
        said.read_line(&mut line).unwrap();
        let cycle = line.strip_prefix("cycle ").and_then(|rest| rest.split(':').next()).expect("a cycle");
        cycles.push(cycle.parse::<u64>().unwrap());
        assert!(line.contains("angle 0.0") && line.contains("micro-steps"), "{line}");
    }
    assert!(cycles.is_sorted_by(|one, next| one < next), "{cycles:?}");
    kill(Pid::from_raw(run.id().cast_signed()), Signal::SIGTERM).unwrap();
    assert_eq!(run.wait().unwrap().code(), Some(0));
    let mut rest = String::new();
    said.read_to_string(&mut rest).unwrap();
    assert!(rest.ends_with("watched: not running\n"), "{rest}");
    assert!(client.wait().unwrap().success());
    place.assert_nothing_left(&["watched"]);
}

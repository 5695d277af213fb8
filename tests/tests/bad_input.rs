//! Bad input is refused with its place before any process starts or shared memory is touched: exit code 2.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::path::Path;
use stepvalve_tests::TestPlace;

/// Simulates a file that must be refused, and looks for what the message has to say.
#[track_caller]
fn refused(place: &TestPlace, file: &Path, says: &[&str]) {
    for mode in ["realtime", "lockstep", "in-process"] {
        let finished = place.simulate(file, mode, "out").expect_code(2);
        for part in says {
            assert!(finished.stderr.contains(part), "{part:?} is not in: {}", finished.stderr);
        }
        assert!(finished.stdout.is_empty(), "{}", finished.stdout);
        assert!(!place.path("out").exists(), "an output folder was made");
        assert!(!place.path("runtime/stepvalve").exists(), "an instance was made");
    }
    let checked = place.stepvalve(&["check", file.to_str().unwrap()]).expect_code(2);
    assert!(checked.stderr.contains(says[0]), "{}", checked.stderr);
}

#[test]
fn scenarios() {
    let cases: [(&str, &str, &[&str]); 7] = [
        ("seed", "sed = 1", &["sed", "unknown"]),
        ("duration", "", &["duration"]),
        ("max_speed", "max_speed = nan", &["max_speed", ":"]),
        ("period", "period = \"-1ms\"", &["period", "100 us"]),
        ("duration", "duration = inf", &["duration"]),
        ("truth", "truth = \"missing.toml\"", &["missing.toml"]),
        ("angle = \"40deg\"", "angle = \"400deg\"", &["400", "angle"]),
    ];
    for (key, replacement, says) in cases {
        let place = TestPlace::new();
        let file = place.scenario("step-sequence.toml", &[(key, replacement)]);
        refused(&place, &file, says);
    }
}

#[test]
fn positions_are_exact() {
    let place = TestPlace::new();
    let file = place.scenario("step-sequence.toml", &[("seed", "  sed = 1")]);
    let text = std::fs::read_to_string(&file).unwrap();
    let line = text.lines().position(|line| line == "  sed = 1").unwrap() + 1;
    let finished = place.stepvalve(&["check", file.to_str().unwrap()]).expect_code(2);
    let expected = format!("{}:{line}:3:", file.display());
    assert!(finished.stderr.contains(&expected), "{expected} is not in {}", finished.stderr);
}

#[test]
fn models() {
    let place = TestPlace::new();
    let rig =
        std::fs::read_to_string(stepvalve_tests::repository().join("rt-config/models/rig.toml")).unwrap();
    let cases = [
        (rig.replace("stepvalve-model", "stepvalve-scenario"), "format"),
        (rig.replace("static_torque_nm = 3.0", "static_torque_nm = 1.0"), "static_torque_nm"),
        (rig.replace("[load]", "[laod]"), "laod"),
        (rig.replace("holding_torque_nm = 6.0", "holding_torque_nm = nan"), "holding_torque_nm"),
        ("format = ".to_owned(), "TOML"),
    ];
    for (text, says) in cases {
        let model = place.write("model.toml", &text);
        let truth = format!("truth = \"{}\"", model.display());
        let file = place.scenario("step-sequence.toml", &[("truth", &truth)]);
        refused(&place, &file, &["model.toml"]);
        let finished = place.simulate(&file, "lockstep", "out").expect_code(2);
        assert!(finished.stderr.contains(says), "{says} is not in {}", finished.stderr);
    }
}

#[test]
fn unreachable_flows_and_rotation_within_limits() {
    let place = TestPlace::new();
    let file = place.scenario("flow-steps.toml", &[("flow", "flow = \"9000L/min\"")]);
    refused(&place, &file, &["9000"]);
    let file = place.scenario("step-sequence.toml", &[("angle = \"40deg\"", "speed = \"1rad/s\"")]);
    refused(&place, &file, &["speed"]);
}

#[test]
fn usage() {
    let place = TestPlace::new();
    for arguments in
        [&["simulate"][..], &["simulate", "x.toml", "--out", "y", "--mode", "fast"], &["no-such-command"]]
    {
        place.stepvalve(arguments).expect_code(2);
    }
    let missing = place.stepvalve(&["simulate", "/nonexistent/x.toml", "--out", "y"]).expect_code(2);
    assert!(missing.stderr.contains("/nonexistent/x.toml"), "{}", missing.stderr);
    let not_a_record = place.write("x.mcap", "not a record");
    place.stepvalve(&["convert", not_a_record.to_str().unwrap(), "--out", "x.h5"]).expect_code(2);
    place.stepvalve(&["replay", not_a_record.to_str().unwrap()]).expect_code(2);
}

//! Bad input is refused with its place before any process starts or shared memory is touched: exit code 2.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::{Log, Run};
use std::path::Path;
use stepvalve_tests::{TestPlace, repository};

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
    let rig = std::fs::read_to_string(repository().join("rt-config/models/rig.toml")).unwrap();
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

/// A tone keeps the simulated spool from standing still, so that it is never armed: no success.
#[test]
fn a_valve_that_is_never_armed_is_no_success() {
    let place = TestPlace::new();
    let rig = std::fs::read_to_string(repository().join("rt-config/models/rig.toml")).unwrap();
    let tone = "\n[[effect]]\nid = \"formula\"\nname = \"tone\"\nacts_on = \"torque\"\n\
                expression = \"a*sin(106.8*time)\"\nparameters = { a = 0.3 }\n";
    place.write("truth.toml", &(rig + tone));
    let scenario = place.scenario("step-sequence.toml", &[("truth", "truth = \"truth.toml\"")]);
    for mode in ["in-process", "lockstep"] {
        let finished = place.simulate(&scenario, mode, mode).expect_code(1);
        assert!(finished.stderr.contains("the valve never ran"), "{}", finished.stderr);
        assert!(place.path(mode).join("run.html").exists(), "what it did is there to be seen");
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

/// The file may be for another machine: it is good, but one should know.
#[test]
fn a_core_that_is_not_here_is_noted() {
    let place = TestPlace::new();
    let scenario = place.shortened("step-sequence.toml", 1.0, &[]);
    let text = std::fs::read_to_string(&scenario).unwrap();
    assert!(text.contains("core = 1"), "{text}");
    std::fs::write(&scenario, text.replace("core = 1", "core = 511")).unwrap();
    let checked = place.stepvalve(&["check", scenario.to_str().unwrap()]).expect_code(0);
    let note = "note: step-controller is to stay on core 511; here are cores ";
    assert!(checked.stdout.contains(note), "{}{}", checked.stdout, checked.stderr);
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
    let empty = place.path("empty");
    std::fs::create_dir(&empty).unwrap();
    for command in [&["replay"][..], &["convert", "--out", "x.h5"]] {
        let arguments = [command, &[empty.to_str().unwrap()]].concat();
        let refused = place.stepvalve(&arguments).expect_code(2);
        assert!(refused.stderr.contains("found no run-*.mcap in it"), "{}", refused.stderr);
    }
}

/// A second of sliding with its torque.
fn sliding() -> Run {
    let time_s: Vec<f64> = (0..1000).map(|k| 1e-3 * f64::from(k)).collect();
    let angle_rad = time_s.clone();
    let torque_nm = Some(vec![1.5; 1000]);
    Run {
        name: "slide".to_owned(),
        kind: "constant-velocity".to_owned(),
        time_s,
        angle_rad,
        torque_nm,
        ..Run::default()
    }
}

fn log_of(place: &TestPlace, name: &str, runs: Vec<Run>) -> String {
    let path = place.path(name);
    run_log::write_log(&path, &Log { title: "test".to_owned(), runs, ..Log::default() }).unwrap();
    path.to_str().unwrap().to_owned()
}

/// `diagnose` and `predict` refuse, naming all of `says`, and leave nothing behind.
#[track_caller]
fn both_refuse(place: &TestPlace, log: &str, model: &Path, says: &[&str]) {
    for command in ["diagnose", "predict"] {
        let out = place.path("refused");
        let (model, out_text) = (model.to_str().unwrap(), out.to_str().unwrap());
        let finished =
            place.stepvalve(&[command, "--log", log, "--model", model, "--out", out_text]).expect_code(2);
        for part in says {
            assert!(finished.stderr.contains(part), "{command}: {part:?} is not in: {}", finished.stderr);
        }
        let left: Vec<_> =
            std::fs::read_dir(place.path("")).unwrap().flatten().map(|of| of.file_name()).collect();
        assert!(
            !left.iter().any(|name| name.to_string_lossy().contains("refused")),
            "{command} left {left:?}"
        );
    }
}

/// Numbers that no valve has.
#[test]
fn models_to_predict_and_diagnose_with() {
    let place = TestPlace::new();
    let log = log_of(&place, "log.h5", vec![sliding()]);
    let rig = std::fs::read_to_string(repository().join("rt-config/models/rig.toml")).unwrap();
    let with = |key: &str, value: &str| {
        let line = rig.lines().find(|line| line.starts_with(&format!("{key} = "))).unwrap();
        rig.replace(line, &format!("{key} = {value}"))
    };
    let cases = [
        ("coulomb_torque_nm", "-1.5"),
        ("coulomb_torque_nm", "0.0"),
        ("static_torque_nm", "1.0"),
        ("stribeck_exponent", "0.0"),
        ("stribeck_velocity_rad_per_s", "0.0"),
        ("bristle_stiffness_nm_per_rad", "-1000.0"),
        ("viscous_nm_s_per_rad", "-1.0e-4"),
        ("inertia_kg_m2", "-1.0e-4"),
        ("static_torque_nm", "nan"),
    ];
    for (key, value) in cases {
        let model = place.write("bad.toml", &with(key, value));
        both_refuse(&place, &log, &model, &["bad.toml", key]);
    }
    both_refuse(&place, &log, &place.write("bad.toml", "no TOML at all ="), &["bad.toml"]);
    both_refuse(&place, &log, &place.path("missing.toml"), &["missing.toml"]);
}

/// Logs from which neither can make anything, each with the run and the row to look at.
#[test]
fn logs_to_predict_and_diagnose() {
    let place = TestPlace::new();
    let rig = repository().join("rt-config/models/rig.toml");
    let bad = |change: &dyn Fn(&mut Run)| {
        let mut run = sliding();
        change(&mut run);
        log_of(&place, "bad.h5", vec![run])
    };
    let cut = |run: &mut Run, length: usize| {
        run.time_s.truncate(length);
        run.angle_rad.truncate(length);
        run.torque_nm.as_mut().unwrap().truncate(length);
    };
    both_refuse(&place, &bad(&|run| cut(run, 1)), &rig, &["run slide", "1 sample"]);
    both_refuse(
        &place,
        &bad(&|run| run.angle_rad[41..].fill(f64::NAN)),
        &rig,
        // The row, or how much of it is missing.
        &["run slide", "angle"],
    );
    both_refuse(&place, &bad(&|run| run.torque_nm = None), &rig, &["run slide", "torque", "angle_command"]);
    // A log without any run: our own writer refuses to make one.
    let empty = place.path("empty.h5");
    std::fs::copy(bad(&|_| ()), &empty).unwrap();
    let file = hdf5::File::open_rw(&empty).unwrap();
    file.group("runs").unwrap().unlink("slide").unwrap();
    file.close().unwrap();
    both_refuse(&place, empty.to_str().unwrap(), &rig, &["empty.h5", "run"]);
    let text = place.write("text.h5", "time,angle\n0,1\n");
    both_refuse(&place, text.to_str().unwrap(), &rig, &["text.h5"]);
    let whole = std::fs::read(log_of(&place, "whole.h5", vec![sliding()])).unwrap();
    for part in [1, 3, 7] {
        let path = place.path("cut.h5");
        std::fs::write(&path, &whole[..whole.len() * part / 8]).unwrap();
        both_refuse(&place, path.to_str().unwrap(), &rig, &["cut.h5"]);
    }
}

/// A unit behind a blank is part of the value, and what follows is none of it.
#[test]
fn a_set_point_may_have_its_unit_behind_a_blank() {
    let place = TestPlace::new();
    for value in [&["17deg"][..], &["17", "deg"], &["-17", "deg"]] {
        let arguments = [&["set", "angle"], value, &["--instance", "nobody"]].concat();
        let refused = place.stepvalve(&arguments).expect_code(2);
        assert!(refused.stderr.contains("no instance \"nobody\" runs"), "{value:?}: {}", refused.stderr);
    }
}

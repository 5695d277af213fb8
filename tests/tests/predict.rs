//! `stepvalve predict`: torque from motion, angle from command, and what it says about bad logs.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::{Channel, Log, Run};
use std::path::{Path, PathBuf};
use stepvalve_tests::{Finished, TestPlace, repository};

const STEP_RAD: f64 = std::f64::consts::TAU / 131_072.0;

fn rig() -> PathBuf {
    repository().join("rt-config/models/rig.toml")
}

fn predict(place: &TestPlace, log: &Path, model: &Path) -> Finished {
    let out = place.path("pred.h5");
    let arguments = ["predict", "--log", log.to_str().unwrap(), "--model", model.to_str().unwrap()];
    place.stepvalve(&[&arguments[..], &["--out", out.to_str().unwrap()]].concat())
}

/// A run at 1 kHz whose angle is a whole number of encoder steps.
fn run(name: &str, duration_s: f64, angle: impl Fn(f64) -> f64, torque: impl Fn(f64) -> f64) -> Run {
    let time_s: Vec<f64> = (0..(duration_s * 1e3) as usize).map(|k| 1e-3 * k as f64).collect();
    let angle_rad = time_s.iter().map(|t| (angle(*t) / STEP_RAD).round() * STEP_RAD).collect();
    let torque_nm = Some(time_s.iter().map(|t| torque(*t)).collect());
    Run { name: name.to_owned(), kind: "test".to_owned(), time_s, angle_rad, torque_nm, ..Run::default() }
}

fn write(place: &TestPlace, runs: Vec<Run>) -> PathBuf {
    let path = place.path("log.h5");
    let log = Log { title: "test".to_owned(), runs, ..Log::default() };
    run_log::write_log(&path, &log).unwrap();
    path
}

fn predicted(place: &TestPlace) -> Log {
    run_log::read_log(&place.path("pred.h5")).unwrap()
}

#[test]
fn torque_of_sliding_and_inertia() {
    let place = TestPlace::new();
    // Steady speeds, both ways, and a sine whose inertia shows: T = ±(T_c + σ2·|ω|) + J_load·dω/dt once sliding.
    let viscous = 2e-4;
    let mut runs = Vec::new();
    for (name, speed) in [("slow", 0.4), ("fast", 33.5), ("back", -11.2)] {
        let torque = 1.5f64.copysign(speed) + viscous * speed;
        runs.push(run(name, 3.0, |t| speed * t, |_| torque));
    }
    let log = write(&place, runs.clone());
    predict(&place, &log, &rig()).expect_code(0);
    let found = predicted(&place);
    for (given, found) in runs.iter().zip(["slow", "fast", "back"].map(|name| found.run(name).unwrap())) {
        assert_eq!(found.time_s, runs.iter().find(|run| run.name == found.name).unwrap().time_s);
        let expected = runs.iter().find(|run| run.name == found.name).unwrap().torque_nm.as_ref().unwrap()[0];
        for (torque, time) in found.torque_nm.as_ref().unwrap().iter().zip(&found.time_s).skip(200) {
            let apart = (torque - expected).abs();
            assert!(apart < 2e-3, "{} at {time} s: {torque}, expected {expected}", given.name);
        }
    }
}

/// The closed loop's own record, without its torque: the angle from the command is the plant's own.
#[test]
fn angle_from_the_command_of_a_simulated_run() {
    let place = TestPlace::new();
    // A rotor without current goes where it likes: the windings carry it from the first row to the last.
    let holds = "after_stop = \"hold\"\nholds_when_disarmed = true";
    let scenario = place.shortened("sine-1hz.toml", 2.5, &[("after_stop", holds)]);
    place.simulate(&scenario, "in-process", "out").expect_code(0);
    let mut log = run_log::read_log(&place.path("out/run.h5")).unwrap();
    let run = &mut log.runs[0];
    run.torque_nm = None;
    let truth = run.extra("true_angle").unwrap().values.clone();
    let path = write(&place, log.runs);
    predict(&place, &path, &rig()).expect_code(0);
    let found = predicted(&place);
    let found = &found.runs[0];
    assert!(found.torque_nm.is_none());
    let worst =
        found.angle_rad.iter().zip(&truth).map(|(found, truth)| (found - truth).abs()).fold(0.0, f64::max);
    // The encoder's step at the start, and an encoder without a coupling's play.
    assert!(worst < 2.0 * STEP_RAD, "{worst} rad apart");
    assert!(truth.iter().fold(0.0, |most: f64, angle| most.max(angle.abs())) > 0.1);
}

#[test]
fn the_bristles_at_the_start_are_estimated_from_the_torque() {
    let place = TestPlace::new();
    // At rest under 0.8 N·m, as a valve stands after a move.
    let log = write(&place, vec![run("rest", 2.0, |_| 0.1, |_| 0.8)]);
    predict(&place, &log, &rig()).expect_code(0);
    let found = predicted(&place);
    let torque = found.runs[0].torque_nm.as_ref().unwrap();
    assert!(torque.iter().all(|torque| (torque - 0.8).abs() < 0.01), "{:?}", &torque[..3]);
    // Without a torque to estimate it from, what depends on it is left out.
    let path = place.path("pred.h5");
    std::fs::remove_file(path).unwrap();
    let log = write(&place, vec![run("slide", 2.0, |t| 0.3 * t, |_| f64::NAN)]);
    let finished = predict(&place, &log, &rig()).expect_code(0);
    assert!(finished.stdout.contains("left out"), "{}", finished.stdout);
    let found = predicted(&place);
    let torque = found.runs[0].torque_nm.as_ref().unwrap();
    assert!(torque[0].is_nan() && (torque[1000] - 1.50006).abs() < 2e-3, "{} {}", torque[0], torque[1000]);
}

/// The rig's model, its bristles replaced by elements with a memory.
fn with_elements(place: &TestPlace) -> PathBuf {
    let text = std::fs::read_to_string(rig()).unwrap();
    let effect = "\n[[effect]]\nid = \"presliding-hysteresis\"\nspacing_exponent = 2.0\ncurve_share = 1.0\n";
    let model = place.path("model.toml");
    std::fs::write(&model, text + effect).unwrap();
    model
}

/// Elements that slid backwards and are half-way relieved go on otherwise than elements that were relaxed and never slid.
#[test]
fn where_bristles_with_a_memory_came_from_is_estimated_too() {
    let place = TestPlace::new();
    let model = with_elements(&place);
    let back_and_forth =
        |t: f64| if t < 1.0 { -0.1 * t } else { -0.1 + 3e-3 * (1.0 - (3.0 * (t - 1.0)).cos()) };
    let log = write(&place, vec![run("whole", 3.0, back_and_forth, |_| 0.0)]);
    predict(&place, &log, &model).expect_code(0);
    let whole = predicted(&place).runs[0].clone();
    let torque_nm = whole.torque_nm.clone().unwrap();
    // It begins as the torque goes through zero, after the turn.
    let from = 1000 + torque_nm.iter().skip(1000).position(|torque| *torque > 0.0).unwrap();
    let later = |t: f64| back_and_forth(t + 1e-3 * from as f64);
    let mut rest = run("rest", 3.0 - 1e-3 * from as f64, later, |_| 0.0);
    rest.torque_nm = Some(torque_nm[from..from + rest.time_s.len()].to_vec());
    let log = write(&place, vec![rest]);
    std::fs::remove_file(place.path("pred.h5")).unwrap();
    predict(&place, &log, &model).expect_code(0);
    let found = predicted(&place).runs[0].clone();
    assert!(found.attributes.contains_key("initial_bristle_came_from_rad"), "{:?}", found.attributes);
    let again = found.torque_nm.unwrap();
    let worst = again.iter().zip(&torque_nm[from..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 0.05, "{worst} N·m apart from row {from} on");
}

/// The same of a command: a rotor that slid backwards and is swayed within its bristles' reach.
#[test]
fn where_bristles_came_from_is_estimated_from_angles_too() {
    let place = TestPlace::new();
    let model = with_elements(&place);
    let command = |t: f64| if t < 1.0 { -0.1 * t } else { -0.1 + 4e-3 * (1.0 - (3.0 * (t - 1.0)).cos()) };
    let commanded = |name: &str, from: usize, angle_rad: &[f64]| {
        let time_s: Vec<f64> = (0..angle_rad.len()).map(|k| 1e-3 * k as f64).collect();
        let angle_command_rad = Some(time_s.iter().map(|t| command(t + 1e-3 * from as f64)).collect());
        let angle_rad = angle_rad.iter().map(|angle| (angle / STEP_RAD).round() * STEP_RAD).collect();
        Run { name: name.to_owned(), time_s, angle_rad, angle_command_rad, ..Run::default() }
    };
    let log = write(&place, vec![commanded("whole", 0, &[0.0; 3000])]);
    predict(&place, &log, &model).expect_code(0);
    let whole = predicted(&place).runs[0].angle_rad.clone();
    let from = 1500;
    let log = write(&place, vec![commanded("rest", from, &whole[from..])]);
    std::fs::remove_file(place.path("pred.h5")).unwrap();
    predict(&place, &log, &model).expect_code(0);
    let found = predicted(&place).runs[0].clone();
    let worst = found.angle_rad.iter().zip(&whole[from..]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("{worst} rad apart");
    assert!(found.attributes.contains_key("initial_bristle_came_from_rad"), "{:?}", found.attributes);
    assert!(worst < STEP_RAD, "{worst} rad apart from row {from} on");
}

#[test]
fn runs_side_by_side_are_predicted_as_alone() {
    let place = TestPlace::new();
    let make =
        |k: usize| run(&format!("run-{k}"), 1.0, move |t| (0.1 + 0.05 * k as f64) * (6.0 * t).sin(), |_| 0.0);
    let log = write(&place, (0..12).map(make).collect());
    predict(&place, &log, &rig()).expect_code(0);
    let together = predicted(&place);
    for k in [0, 5, 11] {
        std::fs::remove_file(place.path("pred.h5")).unwrap();
        let log = write(&place, vec![make(k)]);
        predict(&place, &log, &rig()).expect_code(0);
        let alone = &predicted(&place).runs[0];
        assert_eq!(together.run(&alone.name).unwrap().torque_nm, alone.torque_nm);
    }
}

/// Refused with exit code 2, naming all of `says`; nothing written.
#[track_caller]
fn refused(place: &TestPlace, log: &Path, model: &Path, says: &[&str]) {
    let finished = predict(place, log, model).expect_code(2);
    for part in says {
        assert!(finished.stderr.contains(part), "{part:?} is not in: {}", finished.stderr);
    }
    assert!(finished.stdout.is_empty(), "{}", finished.stdout);
    let left: Vec<_> =
        std::fs::read_dir(place.path("")).unwrap().flatten().map(|entry| entry.file_name()).collect();
    assert!(!left.iter().any(|name| name.to_string_lossy().contains("pred")), "left: {left:?}");
}

#[test]
fn a_prediction_is_replaced_if_that_is_said_and_the_log_never() {
    let place = TestPlace::new();
    let log = write(&place, vec![run("slow", 1.0, |t| t, |_| 1.5)]);
    predict(&place, &log, &rig()).expect_code(0);
    assert!(predict(&place, &log, &rig()).expect_code(2).stderr.contains("--force"));
    let (log, model) = (log.to_str().unwrap(), rig());
    let forced = |out: &str| {
        let model = model.to_str().unwrap();
        place.stepvalve(&["predict", "--log", log, "--model", model, "--out", out, "--force"])
    };
    let before = std::fs::read(log).unwrap();
    assert!(forced(log).expect_code(2).stderr.contains("is the log"));
    assert_eq!(std::fs::read(log).unwrap(), before);
    forced(place.path("pred.h5").to_str().unwrap()).expect_code(0);
}

/// A recorder that skips a cycle doesn't make its record useless.
#[test]
fn a_few_missing_samples_are_bridged() {
    let place = TestPlace::new();
    let whole = run("whole", 1.0, |t| (3.0 * t).sin(), |_| 1.5);
    let mut holed = Run { name: "holed".to_owned(), ..whole.clone() };
    holed.angle_rad[41..43].fill(f64::NAN);
    let told = predict(&place, &write(&place, vec![whole, holed]), &rig()).expect_code(0).stdout;
    assert!(told.contains(", 2 without angle: nothing is predicted there"), "{told}");
    let found = predicted(&place);
    let torque = |name: &str| found.run(name).unwrap().torque_nm.clone().unwrap();
    for (row, (whole, holed)) in torque("whole").iter().zip(torque("holed")).enumerate() {
        assert_eq!(holed.is_nan(), row == 41 || row == 42, "row {}", row + 1);
        assert!(holed.is_nan() || (whole - holed).abs() < 0.02, "row {}: {holed}, whole {whole}", row + 1);
    }
    assert!(found.run("holed").unwrap().angle_rad[41].is_nan(), "what was measured is written as it was");
}

#[test]
fn too_many_samples_missing_and_runs_too_short() {
    let place = TestPlace::new();
    let good = || run("good", 1.0, |t| t, |_| 1.5);
    let mut holed = run("holed", 1.0, |t| t, |_| 1.5);
    holed.angle_rad[41..341].fill(f64::NAN);
    refused(&place, &write(&place, vec![good(), holed]), &rig(), &["run holed", "row 42", "angle is NaN"]);
    let mut command = run("uncommanded", 1.0, |t| t, |_| 1.5);
    command.torque_nm = None;
    let mut angle_command = command.angle_rad.clone();
    angle_command[7..407].fill(f64::NAN);
    refused(
        &place,
        &write(&place, vec![command.clone()]),
        &rig(),
        &["run uncommanded", "torque", "angle_command"],
    );
    command.set_channel(Channel::AngleCommand, angle_command);
    refused(&place, &write(&place, vec![command.clone()]), &rig(), &["row 8", "angle_command is NaN"]);
    let one = run("short", 0.001, |t| t, |_| 1.5);
    assert_eq!(one.len(), 1);
    refused(&place, &write(&place, vec![one]), &rig(), &["run short", "1 sample"]);
}

#[test]
fn what_the_model_needs() {
    let place = TestPlace::new();
    let text = std::fs::read_to_string(rig()).unwrap();
    let log = write(&place, vec![run("dry", 1.0, |t| t, |_| 1.5)]);
    let effect = "[[effect]]\nid = \"pressure-dependent-friction\"\ngain = 0.02\n";
    let model = place.write("pressure.toml", &format!("{text}\n{effect}"));
    refused(&place, &log, &model, &["run dry", "pressure_drop", "pressure-dependent-friction"]);
    let start = text.find("[motor]").unwrap();
    let bare =
        place.write("bare.toml", &format!("{}{}", &text[..start], &text[text.find("[load]").unwrap()..]));
    predict(&place, &log, &bare).expect_code(0);
    std::fs::remove_file(place.path("pred.h5")).unwrap();
    let mut command = run("angle", 1.0, |t| t, |_| 1.5);
    command.torque_nm = None;
    command.set_channel(Channel::AngleCommand, command.angle_rad.clone());
    refused(&place, &write(&place, vec![command]), &bare, &["run angle", "motor"]);
    let broken =
        place.write("broken.toml", &text.replace("static_torque_nm = 3.0", "static_torque_nm = 1.0"));
    refused(&place, &log, &broken, &["broken.toml", "static_torque_nm"]);
    refused(&place, &place.path("none.h5"), &rig(), &["none.h5"]);
}

/// Files that no careful program writes.
#[test]
fn broken_logs() {
    let raw = |name: &str, time: &[f64], angle: Option<&[f64]>| {
        let place = TestPlace::new();
        let path = place.path("raw.h5");
        let file = hdf5::File::create(&path).unwrap();
        let text = |place: &hdf5::Location, key: &str, value: &str| {
            let value: hdf5::types::VarLenUnicode = value.parse().unwrap();
            place.new_attr::<hdf5::types::VarLenUnicode>().create(key).unwrap().write_scalar(&value).unwrap();
        };
        text(&file, "format", "valve-log");
        file.new_attr::<i64>().create("format_version").unwrap().write_scalar(&1).unwrap();
        let run = file.create_group("runs").unwrap().create_group(name).unwrap();
        let column = |name: &str, unit: &str, values: &[f64]| {
            let dataset = run.new_dataset_builder().with_data(values).create(name).unwrap();
            text(&dataset, "unit", unit);
        };
        column("time", "s", time);
        column("torque", "N*m", &vec![0.0; time.len()]);
        if let Some(angle) = angle {
            column("angle", "rad", angle);
        }
        drop(run);
        file.close().unwrap();
        (place, path)
    };
    let (place, path) = raw("backwards", &[0.0, 1.0, 0.5], Some(&[0.0; 3]));
    refused(&place, &path, &rig(), &["run backwards", "row 3", "increase"]);
    drop(place);
    let (place, path) = raw("nowhere", &[0.0, f64::NAN, 0.5], Some(&[0.0; 3]));
    refused(&place, &path, &rig(), &["run nowhere", "row 2", "NaN"]);
    drop(place);
    let (place, path) = raw("blind", &[0.0, 1.0], None);
    refused(&place, &path, &rig(), &["blind", "angle"]);
    drop(place);
    let (place, path) = raw("endless", &[0.0, 1.0], Some(&[0.0, f64::INFINITY]));
    refused(&place, &path, &rig(), &["run endless", "row 2", "angle is inf"]);
    drop(place);
    let (place, path) = raw("empty", &[], Some(&[]));
    refused(&place, &path, &rig(), &["run empty", "time"]);
    drop(place);
    let (place, path) = raw("lost", &[0.0, 1.0], Some(&[0.0]));
    refused(&place, &path, &rig(), &["run lost", "angle has 1 samples"]);
}

#[test]
fn a_comparison_says_how_far_off_a_prediction_is() {
    let place = TestPlace::new();
    // What slides for seconds takes 1.5 N·m and a little; measured are 0.25 N·m more.
    let viscous = 2e-4;
    let log = write(&place, vec![run("steady", 4.0, |t| 5.0 * t, |_| 1.75 + viscous * 5.0)]);
    let told = predict(&place, &log, &rig()).expect_code(0);
    let hint = told.stdout.lines().last().unwrap();
    assert!(hint.starts_with("how far off: stepvalve compare "), "{hint}");
    let (log, prediction, out) = (log.display().to_string(), place.path("pred.h5"), place.path("off.html"));
    let compared = place
        .stepvalve(&["compare", &log, prediction.to_str().unwrap(), "--out", out.to_str().unwrap()])
        .expect_code(0);
    let off = compared.stdout.split("B is off A by ").nth(1).unwrap();
    let rms: f64 = off.split_whitespace().next().unwrap().parse().unwrap();
    assert!((rms - 0.25).abs() < 0.02, "{}", compared.stdout);
    assert!(std::fs::read_to_string(out).unwrap().contains("Torque, B less A"));
}

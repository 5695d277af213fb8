//! `stepvalve investigate` and next-experiment.toml: what a log leaves open is decided by the experiment that is proposed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::Signal;
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use stepvalve_tests::{Finished, TestPlace, end_instance, program, repository};
use test_needs::python_with_browser;

const NAME: &str = "investigated";

fn rig() -> String {
    std::fs::read_to_string(repository().join("rt-config/models/rig.toml")).unwrap()
}

/// The step sequence of a valve whose friction rises with pressure, at one pressure.
fn pressed(place: &TestPlace) -> PathBuf {
    let effect = "\n[[effect]]\nid = \"pressure-dependent-friction\"\ngain = 0.1\nexponent = 1.0\n";
    place.write("truth.toml", &(rig() + effect));
    place.write("belief.toml", &rig());
    place.scenario(
        "step-sequence.toml",
        &[("truth", "truth = \"truth.toml\""), ("belief", "belief = \"belief.toml\"")],
    )
}

fn investigate(place: &TestPlace, arguments: &[&str], out: &str) -> Finished {
    let (belief, out) = (place.path("belief.toml"), place.path(out));
    let [belief, out] = [&belief, &out].map(|path| path.to_str().unwrap());
    place.stepvalve(&[&["investigate"][..], arguments, &["--against", belief, "--out", out]].concat())
}

fn story(place: &TestPlace, out: &str) -> Value {
    let text = std::fs::read_to_string(place.path(out).join("investigation.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn twins_of_a_simulated_valve_are_told_apart_by_the_experiment_proposed() {
    let place = TestPlace::new();
    let scenario = pressed(&place);
    let within = ["--within", "pressure_drop=0MPa..5MPa"];
    let arguments = [&[scenario.to_str().unwrap()][..], &within].concat();
    let finished = investigate(&place, &arguments, "found").expect_code(0);
    println!("{}", finished.stdout);
    let told = story(&place, "found");
    assert_eq!(told["ended"], "decided", "{told}");
    let steps = told["steps"].as_array().unwrap();
    assert_eq!(steps[0]["open"][0].as_array().unwrap().len(), 2, "{told}");
    let cause = &steps.last().unwrap()["causes"][0];
    assert_eq!(cause["id"], "pressure-dependent-friction", "{told}");
    let gain = cause["parameters"]["gain"]["value"].as_f64().unwrap();
    assert!((gain - 0.1).abs() < 0.003, "{gain}");
    let found = place.path("found");
    // The experiment is a scenario like any other, and each step has its report.
    place.stepvalve(&["check", found.join("1/next-experiment.toml").to_str().unwrap()]).expect_code(0);
    for file in ["investigation.html", "model-extended.toml", "1/report.html", "2/report.html", "2/run-2.h5"]
    {
        assert!(found.join(file).is_file(), "{file}");
    }
    if let Some(python) = python_with_browser() {
        let script = repository().join("tests/browser/test_investigation_page.py");
        let count = steps.len().to_string();
        let page = found.join("investigation.html");
        let words = ["friction rises 10", "friction rises 9.9"]
            .into_iter()
            .find(|words| finished.stdout.contains(words));
        let output = Command::new(python)
            .arg(script)
            .arg(page)
            .args([count.as_str(), words.unwrap()])
            .output()
            .unwrap();
        print!("{}", Finished::from(output).expect_code(0).stdout);
    }
    let again = investigate(&place, &arguments, "found").expect_code(2);
    assert!(again.stderr.contains("holds an investigation"), "{}", again.stderr);
}

#[test]
fn that_nothing_would_decide_is_an_answer() {
    let place = TestPlace::new();
    let scenario = pressed(&place);
    // The pressure is the scenario's one pressure in every experiment.
    let finished = investigate(&place, &[scenario.to_str().unwrap()], "open").expect_code(0);
    let told = story(&place, "open");
    assert_eq!(
        (&told["ended"], told["steps"].as_array().unwrap().len()),
        (&"nothing-more".into(), 1),
        "{told}"
    );
    let said = told["steps"][0]["proposed"].as_str().unwrap();
    assert!(said.contains("can't be told apart on this machine"), "{said}\n{}", finished.stdout);
    assert!(!place.path("open/1/next-experiment.toml").exists());
}

#[test]
fn a_command_measures_on_a_rig() {
    let place = TestPlace::new();
    let rig_program = program("hidden-effect-rig");
    let hidden =
        ["--seed", "4712", "--hidden", "pressure-torque", "--without", "one-pressure", "--samples", "15000"];
    let first = place.path("rig");
    let status = Command::new(&rig_program).args(hidden).arg("--out").arg(&first).status().unwrap();
    assert!(status.success());
    std::fs::copy(first.join("model.toml"), place.path("belief.toml")).unwrap();
    let measure = format!(
        "{} {} --plan \"$STEPVALVE_PLAN\" --out {made} && mv {made}/log.h5 \"$STEPVALVE_LOG\"",
        rig_program.display(),
        hidden.join(" "),
        made = place.path("made").display()
    );
    let log = first.join("log.h5");
    let arguments = ["--log", log.to_str().unwrap(), "--measure", &measure];
    let finished = investigate(&place, &arguments, "found").expect_code(0);
    println!("{}", finished.stdout);
    let told = story(&place, "found");
    assert_eq!(told["ended"], "decided", "{told}");
    assert_eq!(
        told["steps"].as_array().unwrap().last().unwrap()["causes"][0]["id"],
        "pressure-torque",
        "{told}"
    );
    let csv = std::fs::read_to_string(place.path("found/1/next-experiment.csv")).unwrap();
    let mut lines = csv.lines();
    assert_eq!(
        lines.next().unwrap(),
        "run,time_s,angle_rad,speed_rad_per_s,pressure_drop_pa,oil_temperature_c"
    );
    assert!(lines.all(|line| line.split(',').skip(1).all(|cell| cell.parse::<f64>().is_ok())));
    // A command that fails ends it.
    let failing = ["--log", log.to_str().unwrap(), "--measure", "exit 3"];
    let finished = investigate(&place, &failing, "failed").expect_code(1);
    assert!(finished.stderr.contains("exit 3"), "{}", finished.stderr);
    let silent = ["--log", log.to_str().unwrap(), "--measure", "true"];
    let finished = investigate(&place, &silent, "silent").expect_code(1);
    assert!(finished.stderr.contains("expected a valve-log"), "{}", finished.stderr);
}

#[test]
fn what_cannot_be_investigated_is_refused() {
    let place = TestPlace::new();
    let scenario = pressed(&place);
    let blind = place.scenario("sine-1hz.toml", &[("fitted", "fitted = false")]);
    let [scenario, blind] = [&scenario, &blind].map(|path| path.to_str().unwrap());
    for (arguments, expected) in [
        (vec![blind], "no encoder is fitted"),
        (vec![scenario, "--within", "flow=1..2"], "expected one of angle, speed"),
        (vec![scenario, "--within", "pressure_drop=5MPa..0MPa"], "the smaller value first"),
        (vec![scenario, "--within", "speed=1m..2m"], "rad/s"),
        (vec!["--measure", "true"], "--log"),
        (vec!["--live", "--instance", "nobody"], "nobody"),
        (vec![], "required"),
    ] {
        let finished = investigate(&place, &arguments, "out").expect_code(2);
        assert!(finished.stderr.contains(expected), "{arguments:?}: {}", finished.stderr);
    }
    assert!(!place.path("out/investigation.html").exists());
}

/// Runs a command with these answers on its stdin.
fn answered(place: &TestPlace, arguments: &[&str], answers: &str) -> Finished {
    let mut command = place.within(Command::new(program("stepvalve")));
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(answers.as_bytes()).unwrap();
    child.wait_with_output().unwrap().into()
}

fn live(place: &TestPlace, command: &[&str], answers: &str) -> Finished {
    answered(place, &[command, &["--live", "--instance", NAME]].concat(), answers)
}

/// The step sequence with more friction than believed, and room for the stalls of a busy test machine.
fn rough(place: &TestPlace) -> PathBuf {
    place.write("truth.toml", &rig().replace("coulomb_torque_nm = 1.5", "coulomb_torque_nm = 2.0"));
    place.write("belief.toml", &rig());
    place.scenario(
        "step-sequence.toml",
        &[
            ("truth", "truth = \"truth.toml\""),
            ("belief", "belief = \"belief.toml\""),
            ("silence_cycles", "silence_cycles = 500"),
            ("max_following_error", "max_following_error = \"30deg\""),
        ],
    )
}

fn cycle(place: &TestPlace) -> f64 {
    place.status().unwrap()["angle_rad"].as_f64().unwrap()
}

#[test]
fn a_running_valve_moves_only_where_its_operator_agrees() {
    let place = TestPlace::new();
    let scenario = rough(&place);
    let run = place.start_instance(NAME, &[], &scenario, &place.path("run"));
    let (tuned, belief) = (place.path("tuned.toml"), place.path("belief.toml"));
    let [tuned_text, belief] = [&tuned, &belief].map(|path: &PathBuf| path.to_str().unwrap());
    let tune = ["tune", "--out", tuned_text];
    let finished = live(&place, &tune, "y\ny\n").expect_code(1);
    assert!(finished.stderr.contains("stepvalve arm"), "{}", finished.stderr);
    place.stepvalve(&["arm"]).expect_code(0);
    let before = cycle(&place);
    for answers in ["n\n", ""] {
        live(&place, &tune, answers).expect_code(130);
        assert!(!tuned.exists());
    }
    assert!((cycle(&place) - before).abs() < 1e-3);
    let finished = live(&place, &tune, &"y\n".repeat(40)).expect_code(0);
    println!("{}", finished.stdout);
    let model: toml::Table = toml::from_str(&std::fs::read_to_string(&tuned).unwrap()).unwrap();
    let coulomb = model["friction"]["coulomb_torque_nm"].as_float().unwrap();
    assert!((coulomb - 2.0).abs() < 0.1, "{coulomb}");
    let out = place.path("found");
    let investigate =
        ["investigate", "--against", belief, "--out", out.to_str().unwrap(), "--experiments", "1"];
    let finished = live(&place, &investigate, &"y\n".repeat(80)).expect_code(0);
    println!("{}", finished.stdout);
    let told = story(&place, "found");
    assert_ne!(told["steps"][0]["verdict"], "no-discrepancy", "{told}");
    assert!(Path::new(&out).join("1/run-1.h5").is_file());
    end_instance(run, Signal::SIGTERM);
    place.assert_nothing_left(&[NAME]);
}

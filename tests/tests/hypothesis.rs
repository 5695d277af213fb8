//! `stepvalve diagnose --hypothesis` and `--effects`: laws of the user's beside the causes of the list.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

#[path = "shared/sliding.rs"]
mod sliding;

use log_data::Run;
use sliding::{NOISE_NM, json, rig, write};
use std::path::{Path, PathBuf};
use stepvalve_tests::{Finished, TestPlace};

/// N·m·s²/rad², of a rig whose model has none.
const DRAG: f64 = 0.02;

/// Runs at eight speeds both ways, with a drag by the square of the speed.
fn dragged(drag: f64) -> Vec<Run> {
    let speeds = [0.5, -0.8, 1.2, -1.7, 2.3, -3.0, 3.6, -4.2];
    let run = |number: u64| {
        let speed = speeds[number as usize % speeds.len()] * if number < 16 { 1.0 } else { -1.0 };
        let mut run = sliding::sliding(&format!("run-{number:02}"), number, speed, 0.0, 0.0);
        run.torque_nm.iter_mut().flatten().for_each(|torque| *torque += drag * speed * speed.abs());
        run
    };
    (0..32).map(run).collect()
}

fn diagnose(place: &TestPlace, log: &Path, out: &str, more: &[&str]) -> Finished {
    let (out, model) = (place.path(out), rig());
    let [log, model, out] = [log, &model, &out].map(|path| path.to_str().unwrap());
    place.stepvalve(&[&["diagnose", "--log", log, "--model", model, "--out", out][..], more].concat())
}

fn effects(place: &TestPlace, text: &str) -> PathBuf {
    let path = place.path("effects.toml");
    std::fs::write(&path, text).unwrap();
    path
}

const EFFECTS: &str = "format = \"stepvalve-effects\"\nformat_version = 1\n\n[[effect]]\nname = \"quadratic-drag\"\n\
    acts_on = \"torque\"\nexpression = \"a*speed*abs(speed)\"\n[effect.parameters.a]\nmin = 0.0\nmax = 1.0\nunit = \"N*m*s^2/rad^2\"\n";

#[test]
fn a_law_that_is_not_listed_is_found_where_it_is_suspected() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", dragged(DRAG));
    diagnose(&place, &log, "list", &[]).expect_code(0);
    let found = json(&place, "list");
    println!("the list alone: {} {}", found["verdict"], found["causes"]);
    assert_ne!(found["verdict"], "explained", "{found}");
    let file = effects(&place, EFFECTS);
    for (out, more, name, unit) in [
        ("text", ["--hypothesis", "torque += a*speed*abs(speed)"], "hypothesis", "1"),
        ("file", ["--effects", file.to_str().unwrap()], "quadratic-drag", "N*m*s^2/rad^2"),
    ] {
        diagnose(&place, &log, out, &more).expect_code(0);
        let found = json(&place, out);
        assert_eq!(found["verdict"], "explained", "{found}");
        let causes = found["causes"].as_array().unwrap();
        assert_eq!((causes.len(), causes[0]["id"].as_str().unwrap()), (1, name), "{found}");
        let drag = &causes[0]["parameters"]["a"];
        let bound = |index: usize| drag["ci95"][index].as_f64().unwrap();
        println!("{name}: {drag}");
        assert!(bound(0) <= DRAG && DRAG <= bound(1) && bound(1) - bound(0) < 0.2 * DRAG, "{drag}");
        assert_eq!(drag["unit"], unit);
        assert!(found["gain"]["rms_after"].as_f64().unwrap() < 1.2 * NOISE_NM, "{found}");
        // The extended model has the law, and predicts.
        let extended = place.path(out).join("model-extended.toml");
        let text = std::fs::read_to_string(&extended).unwrap();
        let says = format!(
            "id = \"formula\"\nname = \"{name}\"\nacts_on = \"torque\"\nexpression = \"a*speed*abs(speed)\""
        );
        assert!(text.contains(&says) && text.contains("[effect.parameters]\na = 0.0"), "{text}");
        let (extended, predicted) = (extended.to_str().unwrap(), place.path(&format!("{out}.h5")));
        let of = [
            "predict",
            "--log",
            log.to_str().unwrap(),
            "--model",
            extended,
            "--out",
            predicted.to_str().unwrap(),
        ];
        place.stepvalve(&of).expect_code(0);
        assert!(std::fs::read_to_string(place.path(out).join("report.html")).unwrap().contains(name));
    }
}

#[test]
fn a_law_that_is_not_there_is_rejected() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", dragged(0.0));
    diagnose(&place, &log, "out", &["--hypothesis", "torque += a*speed*abs(speed)"]).expect_code(0);
    let found = json(&place, "out");
    assert_eq!(found["verdict"], "no-discrepancy", "{found}");
    let rejected = found["rejected"].as_array().unwrap();
    assert!(rejected.iter().any(|of| of["id"] == "hypothesis"), "{found}");
}

/// What a listed cause says in other words can't be told from it.
/// With b below none the law fits these data best, and has no value at low speeds.
#[test]
fn a_law_is_not_fitted_to_where_it_has_no_value() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", dragged(DRAG));
    let more = ["--hypothesis", "torque += a*speed*sqrt(b + abs(speed)); b = 0.1"];
    diagnose(&place, &log, "out", &more).expect_code(0);
    let found = json(&place, "out");
    println!("{} {}", found["verdict"], found["causes"]);
    for cause in found["causes"].as_array().unwrap().iter().filter(|cause| cause["id"] == "hypothesis") {
        assert!(cause["parameters"]["b"]["value"].as_f64().unwrap() >= 0.0, "{cause}");
    }
    place.stepvalve(&["check", place.path("out/model-extended.toml").to_str().unwrap()]).expect_code(0);
}

#[test]
fn a_law_that_is_listed_already_is_a_rival() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", sliding::campaign(0.02));
    diagnose(&place, &log, "out", &["--hypothesis", "level *= 1 + k*abs(pressure_drop)/1e6"]).expect_code(0);
    let found = json(&place, "out");
    assert_eq!(found["verdict"], "ambiguous", "{found}");
    let group = found["ambiguous"][0]["ids"].to_string();
    assert!(group.contains("hypothesis") && group.contains("pressure-dependent-friction"), "{found}");
}

#[test]
fn what_is_no_law_is_refused_at_its_column() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", dragged(0.0));
    for (text, says) in [
        ("torque += a*sped", "column 13: found an unknown name `sped`, expected speed (did you mean it?)"),
        ("torque += a/speed", "column 12: found an operation that has no finite value near speed"),
        (
            "torque += a*(speed + pressure_drop)",
            "column 20: found 1/s beside Pa, expected quantities of one unit",
        ),
        ("load += a*speed", "column 1: found `load += a*speed`"),
        ("torque += 1", "found a law that acts whatever its parameters are"),
    ] {
        let refused = diagnose(&place, &log, "out", &["--hypothesis", text]).expect_code(2);
        assert!(refused.stderr.contains(says), "{text}: {}", refused.stderr);
    }
    for (from, to, says) in [
        (
            "abs(speed)\"",
            "abs(sped)\"",
            "effects.toml:7:27: effect[0].expression: found an unknown name `sped`",
        ),
        ("min = 0.0", "min = 0.5", "found a from 0.5 to 1, expected a range around 0"),
        (
            "N*m*s^2/rad^2",
            "bananas",
            "effects.toml:11:8: effect[0].parameters.a.unit: found `bananas`, expected products",
        ),
        (
            "N*m*s^2/rad^2",
            "N*m*s/rad",
            "effects.toml:7:15: effect[0].expression: found N*m/s, expected a torque in N*m",
        ),
        ("min = 0.0", "least = 0.5", "effects.toml:9:1: effect[0].parameters.a.least: found an unknown key"),
    ] {
        let file = effects(&place, &EFFECTS.replace(from, to));
        let refused = diagnose(&place, &log, "out", &["--effects", file.to_str().unwrap()]).expect_code(2);
        assert!(refused.stderr.contains(says), "{to}: {}", refused.stderr);
    }
    assert!(!place.path("out").exists());
}

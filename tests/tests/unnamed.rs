//! `stepvalve diagnose` where no cause of the list explains what is left: laws without a name, in words, in the model and in diagnosis.json.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

#[path = "shared/sliding.rs"]
mod sliding;

use log_data::Run;
use serde_json::Value;
use sliding::{NOISE_NM, json, rig, write};
use stepvalve_tests::TestPlace;

/// Runs at eight speeds both ways at four pressures, with a torque beside the model's.
fn loaded(torque_nm: impl Fn(f64, f64) -> f64) -> Vec<Run> {
    let speeds = [0.5, -0.8, 1.2, -1.7, 2.3, -3.0, 3.6, -4.2];
    let pressures_mpa = [9.0, 0.0, 4.0, 15.0];
    let run = |number: u64| {
        let speed = speeds[number as usize % speeds.len()] * if number < 16 { 1.0 } else { -1.0 };
        let pressure_mpa = pressures_mpa[(number / 8) as usize];
        let mut run = sliding::sliding(&format!("run-{number:02}"), number, speed, pressure_mpa, 0.0);
        run.torque_nm.iter_mut().flatten().for_each(|torque| *torque += torque_nm(speed, pressure_mpa));
        run
    };
    (0..32).map(run).collect()
}

fn diagnose(place: &TestPlace, torque_nm: impl Fn(f64, f64) -> f64) -> (Value, String) {
    let log = write(place, "log.h5", loaded(torque_nm));
    let said = sliding::diagnose(place, &log, &rig(), "out").expect_code(0).stdout;
    (json(place, "out"), said)
}

#[test]
fn a_law_that_no_cause_has_is_found_and_put_into_the_model() {
    const DRAG: f64 = 0.02;
    let place = TestPlace::new();
    let (found, said) = diagnose(&place, |speed, _| DRAG * speed * speed.abs());
    println!("{} {} {}", found["verdict"], found["causes"], found["unnamed"]);
    assert_eq!(found["verdict"], "unexplained", "{found}");
    let laws = found["unnamed"].as_array().unwrap();
    assert_eq!(laws.len(), 1, "{laws:?}");
    let law = &laws[0];
    assert_eq!(
        (&law["acts_on"], &law["expression"]),
        (&"torque".into(), &"a*speed*abs(speed)".into()),
        "{law}"
    );
    assert_eq!(law["depends_on"], serde_json::json!(["speed"]));
    let drag = &law["parameters"]["a"];
    let bound = |index: usize| drag["ci95"][index].as_f64().unwrap();
    assert!(bound(0) <= DRAG && DRAG <= bound(1) && bound(1) - bound(0) < 0.2 * DRAG, "{drag}");
    assert_eq!(drag["unit"], "N*m/(rad/s)^2");
    // What it brings on runs held out is noise, and the extended model is the one that does.
    let gain = &found["gain"];
    let number = |of: &Value| of.as_f64().unwrap();
    assert!(number(&gain["unnamed"]["rms_after"]) < 1.2 * NOISE_NM, "{gain}");
    assert!(number(&gain["unnamed"]["rms_before"]) > 3.0 * NOISE_NM, "{gain}");
    assert_eq!(gain["rms_after"], gain["unnamed"]["rms_after"]);
    let model = std::fs::read_to_string(place.path("out").join("model-extended.toml")).unwrap();
    let entry =
        "id = \"formula\"\nname = \"by-speed\"\nacts_on = \"torque\"\nexpression = \"a*speed*abs(speed)\"";
    assert!(model.contains(entry) && model.contains("no cause of its list explains"), "{model}");
    assert!(
        said.contains("by-speed, without a name: a torque depends on speed like a*speed*abs(speed)"),
        "{said}"
    );
    sliding::look_at(&place.path("out").join("report.html"), "Beyond the list");
}

#[test]
fn a_law_of_two_quantities_is_found() {
    let place = TestPlace::new();
    let (found, _) = diagnose(&place, |speed, pressure_mpa| 0.004 * speed * pressure_mpa);
    println!("{} {} {}", found["verdict"], found["causes"], found["unnamed"]);
    let law = &found["unnamed"][0];
    let depends_on = law["depends_on"].to_string();
    // Viscous friction is a torque by the speed already.
    let by_speed = depends_on.contains("speed") || law["acts_on"] == "viscous";
    assert!(by_speed && depends_on.contains("pressure_drop"), "{found}");
    assert!(found["gain"]["rms_after"].as_f64().unwrap() < 1.2 * NOISE_NM, "{found}");
}

#[test]
fn laws_that_do_as_well_are_told_and_the_next_experiment_tells_them_apart() {
    let place = TestPlace::new();
    // The oil warms as the pressure rises, so that a torque by the one is a torque by the other.
    let mut runs = loaded(|_, pressure_mpa| 0.002 * pressure_mpa * pressure_mpa);
    for run in &mut runs {
        let warms = |pressure_pa: &f64| 40.0 + 1.5 * pressure_pa / 1e6;
        run.oil_temperature_c = Some(run.pressure_drop_pa.as_ref().unwrap().iter().map(warms).collect());
    }
    let log = write(&place, "log.h5", runs);
    let said = sliding::diagnose(&place, &log, &rig(), "out").expect_code(0).stdout;
    let found = json(&place, "out");
    let law = &found["unnamed"][0];
    println!("{} {} {law} {}", found["verdict"], found["causes"], found["next_experiment"]);
    let rivals: Vec<String> =
        law["rivals"].as_array().unwrap().iter().map(|rival| rival["depends_on"].to_string()).collect();
    let all = format!("{} {rivals:?}", law["depends_on"]);
    assert!(all.contains("pressure_drop") && all.contains("oil_temperature"), "{found}");
    assert!(said.contains("As well: a torque depends on"), "{said}");
    let next = std::fs::read_to_string(place.path("out").join("next-experiment.toml")).unwrap();
    assert!(next.contains("tells torque by") && next.contains(" from torque by"), "{next}");
}

#[test]
fn noise_and_listed_causes_have_no_law() {
    for (what, verdict, torque_nm) in [
        ("noise", "no-discrepancy", (|_, _| 0.0) as fn(f64, f64) -> f64),
        ("pressure on friction", "explained", |speed, pressure_mpa| 0.03 * pressure_mpa.copysign(speed)),
    ] {
        let place = TestPlace::new();
        let (found, _) = diagnose(&place, torque_nm);
        assert_eq!(found["verdict"], verdict, "{what}: {found}");
        assert_eq!(found["unnamed"], serde_json::json!([]), "{what}: {found}");
        assert!(found["gain"].get("unnamed").is_none(), "{what}: {found}");
    }
}

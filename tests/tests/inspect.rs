//! `stepvalve inspect`, and what `diagnose` says of the log itself.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use hidden_effect_rig::{Campaign, Hidden, LogKind};
use log_data::Channel;
use serde_json::Value;
use std::path::{Path, PathBuf};
use stepvalve_tests::{Finished, TestPlace, measured_data, repository};

/// A campaign with nothing hidden and its model, the angle times a factor.
fn campaign(place: &TestPlace, factor: f64) -> [String; 2] {
    let mut campaign = Campaign::draw(3, &Hidden { samples: 12_000, ..Hidden::none(LogKind::Torque) });
    for run in &mut campaign.log.runs {
        let angle = run.take_channel(Channel::Angle).unwrap();
        run.set_channel(Channel::Angle, angle.iter().map(|angle| factor * angle).collect());
    }
    campaign.write(&place.path("rig")).unwrap();
    ["rig/log.h5", "rig/model.toml"].map(|name| place.path(name).to_str().unwrap().to_owned())
}

#[test]
fn a_record_without_mistakes() {
    let place = TestPlace::new();
    let [log, model] = campaign(&place, 1.0);
    let finished = place.stepvalve(&["inspect", &log, "--model", &model]).expect_code(0);
    assert!(finished.stdout.contains("nothing is wrong with it"), "{}", finished.stdout);
}

#[test]
fn angles_in_degrees_are_named_with_what_speaks_for_it_and_how_to_mend_it() {
    let place = TestPlace::new();
    let [log, model] = campaign(&place, 57.295_779_513);
    let finished = place.stepvalve(&["inspect", &log, "--model", &model]).expect_code(1);
    for part in
        ["MISTAKE angle-unit: with the angle divided by 57.3", "falls from", "--map angle='...*pi/180'"]
    {
        assert!(finished.stdout.contains(part), "{part:?} is not in: {}", finished.stdout);
    }
    let finished = place.stepvalve(&["inspect", &log, "--model", &model, "--json"]).expect_code(1);
    let found: Value = serde_json::from_str(&finished.stdout).unwrap();
    let finding = &found["findings"][0];
    assert_eq!((&finding["kind"], &finding["severity"]), (&"angle-unit".into(), &"mistake".into()));
    assert_eq!(finding["place"]["channels"][0], "angle");
}

#[test]
fn several_logs_are_inspected_as_one() {
    let place = TestPlace::new();
    let [log, model] = campaign(&place, 1.0);
    let other = place.path("other.h5");
    std::fs::copy(&log, &other).unwrap();
    let files = [log.as_str(), other.to_str().unwrap()];
    let finished = place.stepvalve(&["inspect", files[0], files[1], "--model", &model, "--json"]);
    let found: Value = serde_json::from_str(&finished.expect_code(0).stdout).unwrap();
    let alone = place.stepvalve(&["inspect", files[0], "--json"]).expect_code(0);
    let alone: Value = serde_json::from_str(&alone.stdout).unwrap();
    assert_eq!(found["runs"].as_u64(), alone["runs"].as_u64().map(|runs| 2 * runs));
    // Runs are told apart by their log's name, and a name can't stand for two.
    let finished = place.stepvalve(&["inspect", files[0], files[0]]).expect_code(2);
    assert!(finished.stderr.contains("another log is called log"), "{}", finished.stderr);
}

#[test]
fn what_is_no_log_is_refused() {
    let place = TestPlace::new();
    let file = place.write("log.h5", "no log");
    let file = file.to_str().unwrap();
    assert!(place.stepvalve(&["inspect", file]).expect_code(2).stderr.contains("log.h5"));
    place.stepvalve(&["inspect", "missing.h5"]).expect_code(2);
}

/// A model of friction with one level both ways.
fn model(place: &TestPlace, inertia_kg_m2: f64, coulomb_nm: f64, viscous: f64) -> PathBuf {
    let text = format!(
        "format = \"stepvalve-model\"\nformat_version = 1\nname = \"plain\"\n[load]\ninertia_kg_m2 = {inertia_kg_m2:?}\n\
         [friction]\nlaw = \"stribeck\"\ncoulomb_torque_nm = {coulomb_nm:?}\nstatic_torque_nm = {coulomb_nm:?}\n\
         stribeck_velocity_rad_per_s = 0.1\nstribeck_exponent = 2.0\nregularisation_velocity_rad_per_s = 0.05\n\
         viscous_nm_s_per_rad = {viscous:?}\n"
    );
    place.write("model.toml", &text)
}

fn files_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap().flatten().map(|entry| entry.path());
    let mut files: Vec<_> = entries.filter(|path| path.extension().is_some()).collect();
    files.sort();
    files.iter().map(|file| file.to_str().unwrap().to_owned()).collect()
}

/// No mistake is claimed of what others measured, with a model as one has it at first or without.
#[test]
fn records_of_real_drives() {
    let Some(data) = measured_data() else { return };
    let screw = data.join("screw-drive");
    let sets = [
        ("emps", files_in(&data.join("emps")), (1.5e-5, 8.1e-3, 3.2e-5)),
        ("seal-friction", files_in(&data.join("seal-friction")), (0.0, 0.06, 0.0)),
        (
            "screw-drive",
            [files_in(&screw.join("steady_state")), files_in(&screw.join("start_stop"))].concat(),
            (1e-7, 2.9e-3, 2.3e-5),
        ),
        ("motor-cogging", files_in(&data.join("motor-cogging")), (2e-6, 1e-3, 1e-5)),
    ];
    for (name, files, (inertia_kg_m2, coulomb_nm, viscous)) in sets {
        let place = TestPlace::new();
        let model = model(&place, inertia_kg_m2, coulomb_nm, viscous);
        let recipe = repository().join(format!("rt-config/recipes/{name}.toml"));
        let log = place.path("log.h5");
        let (log, recipe) = (log.to_str().unwrap(), recipe.to_str().unwrap());
        let files: Vec<&str> = files.iter().map(String::as_str).collect();
        place.stepvalve(&[&["import", "--recipe", recipe, "--out", log], &files[..]].concat()).expect_code(0);
        let inspect = |more: &[&str]| -> Finished { place.stepvalve(&[&["inspect", log], more].concat()) };
        println!("{name}: {}", inspect(&["--model", model.to_str().unwrap()]).expect_code(0).stdout);
        inspect(&[]).expect_code(0);
    }
}

#[test]
fn a_diagnosis_says_it_first() {
    let place = TestPlace::new();
    let mut campaign = Campaign::draw(5, &Hidden { samples: 12_000, ..Hidden::none(LogKind::Torque) });
    let torque = campaign.log.runs[0].torque_nm.as_mut().unwrap();
    torque[20] = 40.0;
    campaign.write(&place.path("rig")).unwrap();
    let [log, model, out] = ["rig/log.h5", "rig/model.toml", "out"].map(|name| place.path(name));
    let [log, model, folder] = [&log, &model, &out].map(|path| path.to_str().unwrap());
    let finished =
        place.stepvalve(&["diagnose", "--log", log, "--model", model, "--out", folder]).expect_code(0);
    assert!(finished.stdout.contains("note outliers: 1 sample(s) of torque"), "{}", finished.stdout);
    let found: Value = serde_json::from_slice(&std::fs::read(out.join("diagnosis.json")).unwrap()).unwrap();
    assert_eq!(found["data_quality"][0]["kind"], "outliers");
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("The log itself") && page.contains("1 sample(s) of torque"));
    // What is found in a log with a mistake is worth nothing before that is mended: terminal and JSON say so.
    for torque in campaign.log.runs.iter_mut().flat_map(|run| run.torque_nm.as_mut().unwrap()) {
        *torque *= 100.0;
    }
    campaign.write(&place.path("rig")).unwrap();
    let again = ["diagnose", "--log", log, "--model", model, "--out", folder, "--force", "--limit", "2s"];
    let finished = place.stepvalve(&again).expect_code(0);
    assert!(
        finished.stdout.contains("next: Mend the log first: with the torque divided by 100"),
        "{}",
        finished.stdout
    );
    let found: Value = serde_json::from_slice(&std::fs::read(out.join("diagnosis.json")).unwrap()).unwrap();
    assert!(
        found["next_experiment"].as_str().unwrap().starts_with("Mend the log first: with the torque divided")
    );
}

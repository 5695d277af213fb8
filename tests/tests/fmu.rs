//! `stepvalve export fmu`: units that another tool validates and simulates.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::process::Command;
use stepvalve_tests::{Finished, TestPlace, repository};
use test_needs::python;

#[test]
fn fmpy_validates_and_simulates_every_shipped_model_in_both_versions() {
    let Some(python) = python(&["fmpy"]) else { return };
    let place = TestPlace::new();
    for model in ["rig", "paper-initial", "paper-revised"] {
        for version in ["2", "3"] {
            let unit = place.path(&format!("{model} {version}.fmu"));
            let file = repository().join(format!("rt-config/models/{model}.toml"));
            let arguments =
                ["--model", file.to_str().unwrap(), "--out", unit.to_str().unwrap(), "--fmi", version];
            place.stepvalve(&[&["export", "fmu"], &arguments[..]].concat()).expect_code(0);
            let tried =
                Command::new(&python).arg(repository().join("tests/fmu/try_unit.py")).arg(&unit).output();
            let tried = Finished::from(tried.unwrap()).expect_code(0);
            assert!(tried.stdout.contains("all holds"), "{}", tried.stdout);
        }
    }
}

#[test]
fn what_can_not_be_exported_is_told() {
    let place = TestPlace::new();
    let model = |name: &str| repository().join("rt-config/models").join(name).to_str().unwrap().to_owned();
    let (rig, alone) = (model("rig.toml"), model("torque-rig.toml"));
    let unit = place.path("valve.fmu").to_str().unwrap().to_owned();
    let export = |arguments: &[&str]| place.stepvalve(&[&["export", "fmu"], arguments].concat());
    let refused = export(&["--model", &alone, "--out", &unit]).expect_code(2);
    assert!(
        refused.stderr.contains("torque-rig.toml") && refused.stderr.contains("[motor]"),
        "{}",
        refused.stderr
    );
    let refused = export(&["--model", &rig, "--out", &unit, "--library", &rig]).expect_code(2);
    assert!(refused.stderr.contains("rig.toml: found no shared library"), "{}", refused.stderr);
    assert!(
        export(&["--model", &rig, "--out", &unit, "--fmi", "1"])
            .expect_code(2)
            .stderr
            .contains("expected 2 or 3")
    );
    let bad = place.write("bad.toml", "format = \"stepvalve-model\"\nformat_version = 1\nname = 3\n");
    let refused = export(&["--model", bad.to_str().unwrap(), "--out", &unit]).expect_code(2);
    assert!(refused.stderr.contains("bad.toml:3:"), "{}", refused.stderr);
    assert!(!place.path("valve.fmu").exists());
    export(&["--model", &rig, "--out", &unit]).expect_code(0);
    assert!(export(&["--model", &rig, "--out", &unit]).expect_code(2).stderr.contains("--force"));
    export(&["--model", &rig, "--out", &unit, "--force"]).expect_code(0);
}

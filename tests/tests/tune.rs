//! `stepvalve tune`: a belief from a motion or a record, never worse than the one given.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::path::{Path, PathBuf};
use stepvalve_tests::{TestPlace, repository};
use toml::Table;

fn rig() -> String {
    std::fs::read_to_string(repository().join("rt-config/models/rig.toml")).unwrap()
}

/// The rig's model with numbers replaced.
fn with(changes: &[(&str, &str)]) -> String {
    let line = |line: &str| {
        let key = line.split(['=', ' ']).next().unwrap_or("");
        let change = changes.iter().find(|(of, _)| *of == key);
        change.map_or(line.to_owned(), |(key, value)| format!("{key} = {value}"))
    };
    rig().lines().map(line).collect::<Vec<_>>().join("\n")
}

/// A scenario of a valve that is `truth`, with the rig's model as its belief.
fn scenario(place: &TestPlace, shipped: &str, truth: &str) -> PathBuf {
    place.write("truth.toml", truth);
    place.write("belief.toml", &rig());
    place.scenario(shipped, &[("truth", "truth = \"truth.toml\""), ("belief", "belief = \"belief.toml\"")])
}

fn numbers(path: &Path) -> Table {
    toml::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(model: &Table, section: &str, key: &str) -> f64 {
    model[section][key].as_float().unwrap()
}

fn following_error(place: &TestPlace, scenario: &Path, out: &str) -> f64 {
    let out = place.path(out);
    let arguments =
        ["simulate", "--mode", "in-process", "--record", "none", "--json", "--out", out.to_str().unwrap()];
    let finished = place.stepvalve(&[&arguments[..], &[scenario.to_str().unwrap()]].concat());
    finished.summary()["true_following_error_rad"]["rms"].as_f64().unwrap()
}

#[test]
fn numbers_that_are_half_as_large_again_are_found() {
    let place = TestPlace::new();
    let right = [
        ("coulomb_torque_nm", 2.1),
        ("static_torque_nm", 3.4),
        ("stribeck_velocity_rad_per_s", 0.07),
        ("bristle_stiffness_nm_per_rad", 1300.0),
        ("bristle_damping_nm_s_per_rad", 0.7),
    ];
    let texts: Vec<(&str, String)> = right.iter().map(|(key, value)| (*key, format!("{value:?}"))).collect();
    let mut changes: Vec<(&str, &str)> = texts.iter().map(|(key, value)| (*key, value.as_str())).collect();
    changes.push(("inertia_kg_m2", "1.5e-4"));
    let scenario = scenario(&place, "step-sequence.toml", &with(&changes));
    let tuned = place.path("tuned.toml");
    let finished = place
        .stepvalve(&["tune", scenario.to_str().unwrap(), "--out", tuned.to_str().unwrap()])
        .expect_code(0);
    println!("{}", finished.stdout);
    let found = numbers(&tuned);
    for (key, right) in right {
        let value = number(&found, "friction", key);
        assert!((value / right - 1.0).abs() < 0.03, "{key}: {value}, {right} is right");
    }
    let inertia = number(&found, "load", "inertia_kg_m2");
    assert!((inertia / 1.5e-4 - 1.0).abs() < 0.1, "{inertia}");
    // What it is for: another motion, without the observer, which would make up for a wrong belief.
    let with_belief = |belief: &str| {
        let changes = [
            ("truth", "truth = \"truth.toml\""),
            ("belief", belief),
            ("level", "level = \"full\"\nobserver = false"),
        ];
        place.scenario("sine-1hz.toml", &changes)
    };
    let before = following_error(&place, &with_belief("belief = \"belief.toml\""), "before");
    let after = following_error(&place, &with_belief("belief = \"tuned.toml\""), "after");
    let best = following_error(&place, &with_belief("belief = \"truth.toml\""), "best");
    println!(
        "following error: {before:.2e} rad before, {after:.2e} after, {best:.2e} with the truth as belief"
    );
    assert!(after < before && after < 1.2 * best, "{before} {after} {best}");
}

/// One fit goes 60 % of a number at most.
#[test]
fn a_number_that_is_twenty_times_the_belief_s_is_found_with_its_error() {
    let place = TestPlace::new();
    let scenario = scenario(&place, "sine-1hz.toml", &with(&[("viscous_nm_s_per_rad", "4.0e-3")]));
    let tuned = place.path("tuned.toml");
    let arguments = ["tune", scenario.to_str().unwrap(), "--out", tuned.to_str().unwrap()];
    let finished = place.stepvalve(&arguments).expect_code(0);
    println!("{}", finished.stdout);
    let found = number(&numbers(&tuned), "friction", "viscous_nm_s_per_rad");
    // Motor and friction damp alike: 3 % of the scale are 3 % of both together, 0.024 N·m·s/rad.
    assert!((found - 4e-3).abs() < 2.0 * 0.03 * 0.024, "{found}");
    assert!((found - 4e-3).abs() < 2e-4, "{found}");
    let error = |key: &str| {
        let line = finished.stdout.lines().find(|line| line.starts_with(key)).unwrap();
        line.split_whitespace().nth(3).unwrap().parse::<f64>().unwrap()
    };
    assert!((0.03..0.04).contains(&(error("friction.coulomb_torque_nm") / 1.5)), "the data sheet's 3 %");
    assert!((0.03..0.05).contains(&(error("friction.viscous_nm_s_per_rad") / 0.024)));
}

#[test]
fn a_belief_that_is_right_stays_as_it_is() {
    for shipped in ["step-sequence.toml", "sine-1hz.toml"] {
        let place = TestPlace::new();
        let scenario = scenario(&place, shipped, &rig());
        let tuned = place.path("tuned.toml");
        let finished = place
            .stepvalve(&["tune", scenario.to_str().unwrap(), "--out", tuned.to_str().unwrap()])
            .expect_code(0);
        assert!(finished.stdout.contains("the belief stays as it was"), "{}", finished.stdout);
        let (given, found) = (numbers(&place.path("belief.toml")), numbers(&tuned));
        for section in ["friction", "load", "motor"] {
            assert_eq!(found[section], given[section], "{shipped}");
        }
    }
}

#[test]
fn a_record_will_do_in_place_of_a_motion() {
    let place = TestPlace::new();
    let scenario = scenario(&place, "step-sequence.toml", &with(&[("coulomb_torque_nm", "2.0")]));
    place.simulate(&scenario, "in-process", "run").expect_code(0);
    let run = place.path("run");
    let (folder, file) = (run.to_str().unwrap().to_owned(), run.join("run.h5"));
    let belief = place.path("belief.toml");
    let cases: [&[&str]; 3] = [
        &["--record", &folder],
        &["--record", file.to_str().unwrap()],
        &["--record", file.to_str().unwrap(), "--belief", belief.to_str().unwrap()],
    ];
    for (index, case) in cases.into_iter().enumerate() {
        let out = place.path(&format!("tuned-{index}.toml"));
        place.stepvalve(&[&["tune"][..], case, &["--out", out.to_str().unwrap()]].concat()).expect_code(0);
        let coulomb = number(&numbers(&out), "friction", "coulomb_torque_nm");
        assert!((coulomb - 2.0).abs() < 0.05, "{case:?}: {coulomb}");
    }
}

#[test]
fn an_angle_that_no_encoder_measured_is_nobodys_measurement() {
    let place = TestPlace::new();
    let blind = place.shortened("sine-1hz.toml", 1.0, &[("fitted", "fitted = false")]);
    let run = place.path("blind");
    let [blind, run] = [&blind, &run].map(|path| path.to_str().unwrap());
    let said =
        place.stepvalve(&["simulate", blind, "--mode", "lockstep", "--out", run]).expect_code(0).stdout;
    assert!(said.contains("true angle") && !said.contains("as measured"), "{said}");
    let refused = place
        .stepvalve(&["tune", "--record", run, "--out", place.path("tuned.toml").to_str().unwrap()])
        .expect_code(2);
    assert!(refused.stderr.contains("no encoder is fitted"), "{}", refused.stderr);
}

#[test]
fn what_cannot_be_tuned_is_refused() {
    let place = TestPlace::new();
    let scenario = scenario(&place, "step-sequence.toml", &rig());
    let there = place.write("there.toml", "mine");
    let lonely = place.path("run.h5");
    std::fs::write(&lonely, "no HDF5").unwrap();
    let blind = place.scenario("sine-1hz.toml", &[("fitted", "fitted = false")]);
    let out = place.path("out.toml");
    let nowhere = place.path("nowhere/out.toml");
    let [scenario, there_text, lonely, blind, out_text, nowhere] =
        [&scenario, &there, &lonely, &blind, &out, &nowhere].map(|path| path.to_str().unwrap());
    for (arguments, expected) in [
        (vec![scenario, "--out", there_text], "exists"),
        (vec![scenario, "--out", nowhere], "there is no folder"),
        (vec!["--out", out_text], "required"),
        (vec![scenario, "--record", lonely, "--out", out_text], "cannot be used with"),
        (vec!["--record", lonely, "--out", out_text], "run.h5"),
        (vec![blind, "--out", out_text], "no encoder is fitted"),
        (vec![scenario, "--fix", "load.mass=3", "--out", out_text], "--fix load.mass=3"),
    ] {
        let finished = place.stepvalve(&[&["tune"][..], &arguments].concat()).expect_code(2);
        assert!(finished.stderr.contains(expected), "{arguments:?}: {}", finished.stderr);
    }
    assert_eq!(std::fs::read_to_string(&there).unwrap(), "mine");
    assert!(!out.exists());
}

//! `stepvalve diagnose`: what it writes, what it says about bad input, and its page in a browser.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

#[path = "shared/sliding.rs"]
mod sliding;

use log_data::Run;
use sliding::{NOISE_NM, campaign, diagnose, json, look_at, rig, sliding, write};
use std::path::Path;
use stepvalve_tests::{TestPlace, repository};

#[test]
fn friction_that_rises_with_pressure_is_named_and_the_page_says_so() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", campaign(0.02));
    let finished = diagnose(&place, &log, &rig(), "out").expect_code(0);
    let found = json(&place, "out");
    println!("{}", finished.stdout);
    assert_eq!(found["format"], "stepvalve-diagnosis");
    assert_eq!(found["verdict"], "explained", "{found}");
    let causes = found["causes"].as_array().unwrap();
    assert_eq!(causes.len(), 1, "{found}");
    assert_eq!(causes[0]["id"], "pressure-dependent-friction");
    let gain = &causes[0]["parameters"]["gain"];
    assert!((gain["value"].as_f64().unwrap() - 0.02).abs() < 5e-4, "{gain}");
    let held_out = found["gain"]["held_out_runs"].as_array().unwrap();
    assert!(held_out.len() >= 4, "{held_out:?}");
    assert!(found["gain"]["rms_after"].as_f64().unwrap() < 1.2 * NOISE_NM, "{found}");
    let in_loop = &found["gain"]["closed_loop"];
    assert!(in_loop["ratio"].as_f64().unwrap() < 0.95, "{in_loop}");
    // The extended model is a model, and predicts.
    let extended = place.path("out/model-extended.toml");
    place.stepvalve(&["check", extended.to_str().unwrap()]).expect_code(0);
    let predicted = place.path("pred.h5");
    let arguments = ["predict", "--log", log.to_str().unwrap(), "--model", extended.to_str().unwrap()];
    place.stepvalve(&[&arguments[..], &["--out", predicted.to_str().unwrap()]].concat()).expect_code(0);
    // The same seed, the same files; and a folder with a diagnosis is left alone.
    diagnose(&place, &log, &rig(), "again").expect_code(0);
    for file in ["diagnosis.json", "model-extended.toml", "report.html"] {
        let read = |out: &str| std::fs::read(place.path(out).join(file)).unwrap();
        assert!(read("out") == read("again"), "{file} differs between two runs of the same seed");
    }
    let refused = diagnose(&place, &log, &rig(), "out").expect_code(2);
    assert!(refused.stderr.contains("exists"), "{}", refused.stderr);
    look_at(&place.path("out/report.html"), "pressure drop");
}

#[test]
fn nothing_is_found_where_nothing_is_wrong() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", campaign(0.0));
    diagnose(&place, &log, &rig(), "out").expect_code(0);
    let found = json(&place, "out");
    assert_eq!(found["verdict"], "no-discrepancy", "{found}");
    assert_eq!(found["causes"].as_array().unwrap().len(), 0);
    let untestable = found["untestable"].as_array().unwrap();
    let viscosity = untestable.iter().find(|of| of["id"] == "temperature-dependent-viscosity").unwrap();
    assert!(viscosity["reason"].as_str().unwrap().contains("oil_temperature"), "{viscosity}");
    look_at(&place.path("out/report.html"), "agrees with the measurement");
}

/// A few samples that a recorder missed are bridged, and count for nothing.
#[test]
fn missing_samples_cost_their_own_weight_alone() {
    let place = TestPlace::new();
    let mut runs = campaign(0.02);
    for run in &mut runs {
        run.torque_nm.as_mut().unwrap()[100..150].fill(f64::NAN);
        run.angle_rad[300..310].fill(f64::NAN);
        run.pressure_drop_pa.as_mut().unwrap()[500..600].fill(f64::NAN);
    }
    let log = write(&place, "log.h5", runs);
    diagnose(&place, &log, &rig(), "out").expect_code(0);
    let found = json(&place, "out");
    assert_eq!(found["verdict"], "explained", "{found}");
    assert_eq!(found["causes"][0]["id"], "pressure-dependent-friction");
}

/// First guesses of a model, each off by a fifth or more: all are found at once, and the file that is written predicts.
#[test]
fn first_guesses_of_a_model_are_corrected_at_once() {
    let place = TestPlace::new();
    let camp = place.path("camp");
    let drawn = ["--seed", "5", "--samples", "20000", "--out", camp.to_str().unwrap()];
    let made = place.command("hidden-effect-rig").args(drawn).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let mut text = std::fs::read_to_string(camp.join("model.toml")).unwrap();
    let model = config::parse_model(&text, "model.toml").unwrap();
    let off = [
        ("coulomb_torque_nm", 1.0 / 1.25, "coulomb-level"),
        ("static_torque_nm", 1.0 / 1.25, ""),
        ("viscous_nm_s_per_rad", 1.5, "viscous-level"),
        ("bristle_stiffness_nm_per_rad", 0.8, "bristle-stiffness"),
        ("inertia_kg_m2", 1.25, "load-inertia"),
    ];
    for (key, factor, _) in off {
        let line = text.lines().find(|line| line.starts_with(key)).unwrap().to_owned();
        let number: f64 = line.split(['=', '#']).nth(1).unwrap().trim().parse().unwrap();
        text = text.replace(&line, &format!("{key} = {}", number * factor));
    }
    let guess = place.write("guess.toml", &text);
    diagnose(&place, &camp.join("log.h5"), &guess, "out").expect_code(0);
    let found = json(&place, "out");
    assert_eq!(found["verdict"], "explained", "{found}");
    let causes = found["causes"].as_array().unwrap();
    let named: Vec<&str> = causes.iter().map(|cause| cause["id"].as_str().unwrap()).collect();
    for (_, factor, id) in off.into_iter().filter(|of| !of.2.is_empty()) {
        let cause =
            causes.iter().find(|cause| cause["id"] == id).unwrap_or_else(|| panic!("{id}: {named:?}"));
        let value = cause["parameters"]["factor"]["value"].as_f64().unwrap();
        assert!((value * factor - 1.0).abs() < 0.03, "{id} is {value}, of {}", 1.0 / factor);
    }
    assert_eq!(named.len(), 4, "{named:?}");
    // The file is the true model again, and leaves the noise alone.
    let extended = std::fs::read_to_string(place.path("out/model-extended.toml")).unwrap();
    let extended = config::parse_model(&extended, "model-extended.toml").unwrap();
    let (one, other) = (extended.load.unwrap().inertia_kg_m2, model.load.unwrap().inertia_kg_m2);
    assert!((one / other - 1.0).abs() < 0.03, "{one} for {other}");
    let residuals = run_log::read_log(&place.path("out/residuals.h5")).unwrap();
    let noise = found["residual"][0]["noise"].as_f64().unwrap();
    let (sum, count) = residuals.runs.iter().fold((0.0, 0.0), |(sum, count), run| {
        let of = |name: &str| run.extra(name).unwrap().values.clone();
        let squares = of("measured").into_iter().zip(of("predicted_after")).map(|(a, b)| (a - b) * (a - b));
        (sum + squares.sum::<f64>(), count + run.len() as f64)
    });
    assert!((sum / count).sqrt() < 1.3 * noise, "{} beside {noise}", (sum / count).sqrt());
}

/// What a number is off by within its tolerance is no cause, and told all the same.
#[test]
fn a_number_within_its_tolerance_is_corrected_and_not_accused() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", campaign(0.0));
    let text = std::fs::read_to_string(rig()).unwrap();
    let off = text
        .replace("coulomb_torque_nm = 1.5 ", "coulomb_torque_nm = 1.455 ")
        .replace("static_torque_nm = 3.0 ", "static_torque_nm = 2.91 ");
    assert_ne!(off, text);
    let model = place.write("model.toml", &off);
    let said = diagnose(&place, &log, &model, "out").expect_code(0).stdout;
    let found = json(&place, "out");
    assert_eq!(found["verdict"], "no-discrepancy", "{found}");
    assert!(!found["within_tolerance"].as_array().unwrap().is_empty(), "{found}");
    assert!(said.contains("within tolerance"), "{said}");
    // Known exactly, it is wrong.
    let arguments = ["diagnose", "--log", log.to_str().unwrap(), "--model", model.to_str().unwrap()];
    let out = place.path("exactly");
    let rest = ["--tolerance", "0", "--out", out.to_str().unwrap()];
    place.stepvalve(&[&arguments[..], &rest].concat()).expect_code(0);
    assert_ne!(json(&place, "exactly")["verdict"], "no-discrepancy");
    for wrong in ["-0.1", "3", "nan", "3%"] {
        let said = place
            .stepvalve(&[&arguments[..], &["--out", "none", &format!("--tolerance={wrong}")]].concat())
            .expect_code(2)
            .stderr;
        assert!(said.contains("expected a number from 0 to 0.25"), "{said}");
    }
}

/// The first thing that a user tries: a recording of our own, against the model that made it.
#[test]
fn a_recording_of_our_own_agrees_with_its_own_model() {
    let place = TestPlace::new();
    let scenarios = repository().join("rt-config/scenarios");
    for (scenario, model) in [
        ("step-sequence", "rig"),
        ("sine-1hz", "rig"),
        ("flow-steps", "rig"),
        ("rotation-200khz", "rig"),
        ("rotation-600khz", "rig"),
        ("paper-revised", "paper-revised"),
        ("paper-initial", "paper-initial"),
    ] {
        place.stepvalve(&[
            "simulate",
            scenarios.join(format!("{scenario}.toml")).to_str().unwrap(),
            "--mode",
            "in-process",
            "--out",
            place.path(scenario).to_str().unwrap(),
        ]);
        let log = place.path(scenario).join("run.h5");
        let model = repository().join(format!("rt-config/models/{model}.toml"));
        diagnose(&place, &log, &model, &format!("{scenario}-found")).expect_code(0);
        let found = json(&place, &format!("{scenario}-found"));
        assert_eq!(found["verdict"], "no-discrepancy", "{scenario}: {found}");
    }
}

/// A number of the model that is off is corrected where it stands; the extended model runs wherever a model does, and the
/// page says what it is worth in the loop.
/// Filtered data scatter less than the measurement does: who knows its noise says it.
#[test]
fn noise_that_is_known_is_what_errors_are_held_against() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", campaign(0.02));
    let arguments = ["diagnose", "--log", log.to_str().unwrap(), "--model"];
    let told = |noise: &str| {
        let (model, out) = (rig(), place.path(&format!("noise{noise}")));
        let rest = [model.to_str().unwrap(), "--out", out.to_str().unwrap(), noise];
        place.stepvalve(&[&arguments[..], &rest].concat())
    };
    told("--noise=50").expect_code(0);
    let found = json(&place, "noise--noise=50");
    assert_eq!(found["residual"][0]["noise"].as_f64().unwrap().round(), 50.0);
    assert_eq!(found["causes"], serde_json::json!([]), "{}", found["verdict"]);
    for wrong in ["--noise=0", "--noise=-1", "--noise=nan", "--noise=1e-5rad"] {
        let said = told(wrong).expect_code(2).stderr;
        assert!(said.contains("expected a number above zero"), "{said}");
        assert!(!place.path(&format!("noise{wrong}")).exists());
    }
}

#[test]
fn the_page_says_how_much_of_a_long_log_was_looked_at() {
    let place = TestPlace::new();
    let speeds = [0.5, -0.9, 2.0, -4.0, 0.7, -0.6];
    let pressures_mpa = [0.0, 4.0, 9.0, 15.0];
    let run = |number: u64| {
        let speed = speeds[number as usize % speeds.len()];
        let pressure_mpa = pressures_mpa[number as usize / speeds.len() % pressures_mpa.len()];
        sliding(&format!("run-{number:03}"), number, speed, pressure_mpa, 0.0)
    };
    let log = write(&place, "long.h5", (0..312).map(run).collect());
    diagnose(&place, &log, &rig(), "long").expect_code(0);
    assert_eq!(json(&place, "long")["verdict"], "no-discrepancy");
    let page = std::fs::read_to_string(place.path("long/report.html")).unwrap();
    let looked_at = page.split("312, 312000 samples, of which ").nth(1).expect("the page doesn't say it");
    let count: usize = looked_at.split(' ').next().unwrap().parse().unwrap();
    assert!((59_000..=60_000).contains(&count), "{count}");
}

#[test]
fn a_factor_is_folded_into_its_section() {
    let place = TestPlace::new();
    // The rig of this test has ten times the viscous friction that the model believes in.
    let mut runs = campaign(0.0);
    for run in &mut runs {
        let speed = (run.angle_rad[999] - run.angle_rad[0]) / 0.999;
        run.torque_nm.as_mut().unwrap().iter_mut().for_each(|torque| *torque += (0.1 - 2e-4) * speed);
    }
    let log = write(&place, "log.h5", runs);
    let text = std::fs::read_to_string(rig()).unwrap();
    let viscous = |value: &str| format!("viscous_nm_s_per_rad = {value}");
    assert!(text.contains(&viscous("2.0e-4")), "the rig's model has another viscous friction");
    let model = place.write("model.toml", &text.replace(&viscous("2.0e-4"), &viscous("0.01")));
    let finished = diagnose(&place, &log, &model, "out").expect_code(0);
    println!("{}", finished.stdout);
    let found = json(&place, "out");
    assert_eq!(found["verdict"], "explained", "{found}");
    assert_eq!(found["causes"][0]["id"], "viscous-level", "{found}");
    let path = place.path("out/model-extended.toml");
    let extended = std::fs::read_to_string(&path).unwrap();
    let read = config::parse_model(&extended, "model-extended.toml").unwrap();
    assert!(read.effects.is_empty(), "{extended}");
    let valve_model::FrictionParams::LuGre(friction) = read.friction else { panic!("{extended}") };
    assert!((friction.viscous_nm_s_per_rad - 0.1).abs() < 0.005, "{extended}");
    let comment = extended.lines().find(|line| line.starts_with("# viscous-level")).unwrap();
    assert!(comment.contains("viscous_nm_s_per_rad corrected"), "{comment}");
    let factor = extended.split("# factor: ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    assert!((factor.parse::<f64>().unwrap() - 10.0).abs() < 0.3, "{extended}");
    // Prediction, the bare simulation, and the controller's belief take it.
    let (log, extended) = (log.to_str().unwrap(), path.to_str().unwrap());
    let out = place.path("pred.h5");
    let arguments = ["predict", "--log", log, "--model", extended, "--out", out.to_str().unwrap()];
    place.stepvalve(&arguments).expect_code(0);
    let (truth, belief) = (format!("truth = {extended:?}"), format!("belief = {extended:?}"));
    let scenario = place.scenario("sine-1hz.toml", &[("truth", &truth), ("belief", &belief)]);
    place.simulate(&scenario, "in-process", "run").expect_code(0);
    // What it is worth in the loop.
    let in_loop = &found["gain"]["closed_loop"];
    let error = |when: &str| in_loop[format!("following_error_rms_{when}_rad")].as_f64().unwrap();
    let ratio = in_loop["ratio"].as_f64().unwrap();
    assert!((ratio - error("after") / error("before")).abs() < 1e-9 && ratio < 1.0, "{in_loop}");
    let page = std::fs::read_to_string(place.path("out/report.html")).unwrap();
    assert!(page.contains("following error in the loop"));
    // The interval of the gain is a bootstrap's: it holds the ratio.
    let (gain, ci95) = (&found["gain"]["ratio"], &found["gain"]["ratio_ci95"]);
    assert!(ci95[0].as_f64() <= gain.as_f64() && gain.as_f64() <= ci95[1].as_f64(), "{}", found["gain"]);
}

/// At one pressure more friction by pressure and more friction are the same: neither is taken, and the model file offers the
/// one that fitted best to who takes the comment marks away.
#[test]
fn what_fitted_best_of_a_group_is_offered_and_not_taken() {
    let place = TestPlace::new();
    let speeds = [0.5, -0.9, 2.0, -4.0, 0.7, -0.6, 1.2, -1.5].into_iter().enumerate();
    let runs =
        speeds.map(|(number, speed)| sliding(&format!("run-{number}"), number as u64, speed, 10.0, 0.02));
    let log = write(&place, "log.h5", runs.collect());
    let finished = diagnose(&place, &log, &rig(), "out").expect_code(0);
    println!("{}", finished.stdout);
    let found = json(&place, "out");
    assert_eq!(found["verdict"], "ambiguous", "{found}");
    assert_eq!(found["causes"].as_array().unwrap().len(), 0, "{found}");
    let best = &found["ambiguous"][0]["best"];
    assert!(found["ambiguous"][0]["ids"].as_array().unwrap().contains(&best["id"]), "{found}");
    assert!(best["rms_after"].as_f64().unwrap() < 1.2 * NOISE_NM, "{best}");
    assert!(finished.stdout.contains("With what fitted best ("), "{}", finished.stdout);
    let offered = std::fs::read_to_string(place.path("out/model-extended.toml")).unwrap();
    assert!(config::parse_model(&offered, "offered").unwrap().effects.is_empty(), "{offered}");
    let mut lines: Vec<&str> = offered.lines().collect();
    let from = lines.iter().position(|line| *line == "# [[effect]]").expect("nothing is offered");
    lines[from..].iter_mut().for_each(|line| *line = line.trim_start_matches("# "));
    let taken = place.write("taken.toml", &lines.join("\n"));
    let log_path = log.to_str().unwrap();
    let out = place.path("pred.h5");
    let arguments =
        ["predict", "--log", log_path, "--model", taken.to_str().unwrap(), "--out", out.to_str().unwrap()];
    place.stepvalve(&arguments).expect_code(0);
    diagnose(&place, &log, &taken, "again").expect_code(0);
    assert_eq!(json(&place, "again")["verdict"], "no-discrepancy", "{offered}");
}

/// Where the error has a frequency, or comes back turn by turn, the description says so; where it is noise, it says that.
#[test]
fn the_error_is_described_by_frequency_and_by_order() {
    let place = TestPlace::new();
    let clean = write(&place, "clean.h5", campaign(0.0));
    diagnose(&place, &clean, &rig(), "clean").expect_code(0);
    let found = json(&place, "clean");
    let description = &found["description_before"];
    assert_eq!(description["whiteness"]["white"], true, "{}", description["whiteness"]);
    let louder = |description: &serde_json::Value| -> Vec<(f64, f64)> {
        let bands = description["bands"].as_array().unwrap().clone();
        let number = |band: &serde_json::Value, key: &str| band[key].as_f64().unwrap();
        let loud = bands.iter().filter(|band| number(band, "p_value") < 0.01);
        loud.map(|band| (number(band, "from_hz"), number(band, "to_hz"))).collect()
    };
    assert_eq!(louder(description), [], "{description}");
    let humming = |hertz: f64| {
        let mut runs = campaign(0.0);
        for run in &mut runs {
            let hum = |t: &f64| 0.02 * (std::f64::consts::TAU * hertz * t).sin();
            let times = run.time_s.clone();
            run.torque_nm.as_mut().unwrap().iter_mut().zip(&times).for_each(|(torque, t)| *torque += hum(t));
        }
        write(&place, &format!("hum-of-{hertz}.h5"), runs)
    };
    // The mains are no discrepancy: they are taken out of what was measured, and told.
    diagnose(&place, &humming(50.0), &rig(), "mains").expect_code(0);
    let found = json(&place, "mains");
    assert_eq!(found["verdict"], "no-discrepancy", "{found}");
    let nuisances = found["nuisances"].to_string();
    assert!(
        nuisances.contains("a hum of 50.0 Hz, amplitude 2.0") && nuisances.contains("e-2"),
        "{nuisances}"
    );
    // Another hum is no cause of the list.
    diagnose(&place, &humming(37.0), &rig(), "humming").expect_code(0);
    let found = json(&place, "humming");
    let description = &found["description_before"];
    assert_eq!(description["whiteness"]["white"], false, "{}", description["whiteness"]);
    let loud = louder(description);
    assert!(loud.iter().any(|(from, to)| (*from..*to).contains(&37.0)), "{loud:?}");
    let page = std::fs::read_to_string(place.path("humming/report.html")).unwrap();
    assert!(page.contains("could be foretold from the"), "the page doesn't speak of it");
    assert!(page.contains("Error by frequency"), "the page doesn't show it");
    assert_eq!(found["verdict"], "unexplained", "{found}");
    look_at(&place.path("humming/report.html"), "none of the known causes explains it");
}

/// Refused with exit code 2, naming all of `says`; nothing written.
#[track_caller]
fn refused(place: &TestPlace, log: &Path, model: &Path, says: &[&str]) {
    let finished = diagnose(place, log, model, "out").expect_code(2);
    for part in says {
        assert!(finished.stderr.contains(part), "{part:?} is not in: {}", finished.stderr);
    }
    assert!(!place.path("out").exists(), "something was written");
}

#[test]
fn logs_from_which_nothing_can_be_learnt() {
    let place = TestPlace::new();
    let with = |change: &dyn Fn(&mut Run)| {
        let mut runs = campaign(0.0);
        change(&mut runs[5]);
        write(&place, "bad.h5", runs)
    };
    let cut = |run: &mut Run| {
        run.time_s.truncate(3);
        run.angle_rad.truncate(3);
        run.torque_nm.as_mut().unwrap().truncate(3);
        run.pressure_drop_pa.as_mut().unwrap().truncate(3);
    };
    refused(&place, &with(&cut), &rig(), &["run run-05", "row 3", "3 samples"]);
    let mut silent = campaign(0.0);
    silent.iter_mut().for_each(|run| run.torque_nm.as_mut().unwrap().fill(f64::NAN));
    let silent = write(&place, "silent.h5", silent);
    refused(
        &place,
        &silent,
        &rig(),
        &["no run is left", "run run-00 is left out", "samples of torque are missing"],
    );
    let still = |run: &mut Run| run.angle_rad.fill(0.25);
    let mut runs = campaign(0.0);
    runs.iter_mut().for_each(still);
    let log = write(&place, "bad.h5", runs);
    refused(&place, &log, &rig(), &["run run-00", "rows 1 to 1000", "0.25 rad throughout"]);
    // One run that rests among others that move is a hold, whatever it is called; it is told.
    let finished = diagnose(&place, &with(&still), &rig(), "rests").expect_code(0);
    assert!(finished.stdout.contains("angle never changes in run run-05"), "{}", finished.stdout);
    refused(&place, &place.path("none.h5"), &rig(), &["none.h5"]);
    // Cut in the middle, and no HDF5 at all.
    let whole = std::fs::read(write(&place, "whole.h5", campaign(0.0))).unwrap();
    let half = place.path("half.h5");
    std::fs::write(&half, &whole[..whole.len() / 2]).unwrap();
    refused(&place, &half, &rig(), &["half.h5"]);
    refused(&place, &place.write("text.h5", "no HDF5"), &rig(), &["text.h5"]);
}

#[test]
fn files_in_another_format_or_unit() {
    let place = TestPlace::new();
    let change = |attribute: &str, of: Option<&str>, value: &str| {
        let path = write(&place, "changed.h5", campaign(0.0));
        let file = hdf5::File::open_rw(&path).unwrap();
        let value: hdf5::types::VarLenUnicode = value.parse().unwrap();
        let set = |place: &hdf5::Location| {
            place.delete_attr(attribute).unwrap();
            let fresh = place.new_attr::<hdf5::types::VarLenUnicode>().create(attribute).unwrap();
            fresh.write_scalar(&value).unwrap();
        };
        match of {
            Some(dataset) => set(&file.dataset(dataset).unwrap()),
            None => set(&file),
        }
        file.close().unwrap();
        path
    };
    refused(&place, &change("format", None, "other-log"), &rig(), &["format", "other-log"]);
    let unit = change("unit", Some("runs/run-03/torque"), "lbf*ft");
    refused(&place, &unit, &rig(), &["run-03", "torque", "lbf*ft", "N*m"]);
}

#[test]
fn time_that_goes_back_and_models_that_cannot_be_simulated() {
    let place = TestPlace::new();
    let path = write(&place, "back.h5", campaign(0.0));
    let file = hdf5::File::open_rw(&path).unwrap();
    let dataset = file.dataset("runs/run-02/time").unwrap();
    let mut times: Vec<f64> = dataset.read_raw().unwrap();
    times[500] = times[499] - 1.0;
    dataset.write(&times).unwrap();
    drop(dataset);
    file.close().unwrap();
    refused(&place, &path, &rig(), &["run run-02", "row 501", "increase"]);
    let log = write(&place, "log.h5", campaign(0.0));
    let text = std::fs::read_to_string(rig()).unwrap();
    let broken =
        place.write("broken.toml", &text.replace("static_torque_nm = 3.0", "static_torque_nm = 1.0"));
    refused(&place, &log, &broken, &["broken.toml", "static_torque_nm"]);
    // A log of command and angle needs a motor.
    let mut runs = campaign(0.0);
    for run in &mut runs {
        run.torque_nm = None;
        run.angle_command_rad = Some(run.angle_rad.clone());
    }
    let angles = write(&place, "angles.h5", runs);
    let (from, to) = (text.find("[motor]").unwrap(), text.find("[load]").unwrap());
    let bare = place.write("bare.toml", &format!("{}{}", &text[..from], &text[to..]));
    refused(&place, &angles, &bare, &["run run-00", "motor"]);
}

//! `stepvalve diagnose`: several logs in one, runs left out, and the files beside diagnosis.json.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

#[path = "shared/sliding.rs"]
mod sliding;

use log_data::{AngleZero, Attribute};
use sliding::{NOISE_NM, campaign, diagnose, json, look_at, rig, sliding, write};
use stepvalve_tests::TestPlace;
use valve_model::EffectId;

fn rms(one: &[f64], other: &[f64]) -> f64 {
    let squares = one.iter().zip(other).map(|(a, b)| (a - b).powi(2));
    (squares.sum::<f64>() / one.len() as f64).sqrt()
}

#[test]
fn residuals_hold_every_sample_as_predict_has_it() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", campaign(0.02));
    let said = diagnose(&place, &log, &rig(), "out").expect_code(0);
    for step in ["screening causes", "measuring the gain", "predicting every sample"] {
        assert!(said.stderr.contains(step), "progress shows without a terminal: {}", said.stderr);
    }
    let predicted = |model: &str, out: &str| {
        let (log, out) = (log.to_str().unwrap(), place.path(out));
        let arguments = ["predict", "--log", log, "--model", model, "--out", out.to_str().unwrap()];
        place.stepvalve(&arguments).expect_code(0);
        run_log::read_log(&out).unwrap()
    };
    let given = predicted(rig().to_str().unwrap(), "given.h5");
    let extended = predicted(place.path("out/model-extended.toml").to_str().unwrap(), "extended.h5");
    let measured = run_log::read_log(&log).unwrap();
    let residuals = run_log::read_log(&place.path("out/residuals.h5")).unwrap();
    assert_eq!(residuals.attributes["predicted"], Attribute::Text("torque".to_owned()));
    assert_eq!(
        residuals.attributes["standard_deviation"],
        Attribute::Text("of noise and parameters".to_owned())
    );
    assert_eq!(residuals.runs.len(), measured.runs.len());
    for (index, run) in residuals.runs.iter().enumerate() {
        let of = |name: &str| run.extra(name).unwrap().values.as_slice();
        let torque = |log: &log_data::Log| log.runs[index].torque_nm.clone().unwrap();
        assert_eq!(of("measured"), torque(&measured));
        assert_eq!(of("predicted_before"), torque(&given));
        // The file has its numbers with fewer digits.
        assert!(rms(of("predicted_after"), &torque(&extended)) < 1e-6, "{}", run.name);
        assert!(rms(of("measured"), of("predicted_after")) < 1.2 * NOISE_NM, "{}", run.name);
        // The noise, and the gain of 2 % by what it is uncertain.
        let deviation = of("standard_deviation");
        assert!(deviation.iter().all(|of| (0.9 * NOISE_NM..1.3 * NOISE_NM).contains(of)), "{deviation:?}");
    }
    // A valve-log as any other.
    let again = place.path("out/residuals.h5");
    place.stepvalve(&["inspect", again.to_str().unwrap(), "--model", rig().to_str().unwrap()]).expect_code(0);
}

/// Rows that the instrument missed are missing there, and no others.
#[test]
fn residuals_are_missing_where_the_measurement_is() {
    let place = TestPlace::new();
    let mut runs = campaign(0.0);
    runs[3].torque_nm.as_mut().unwrap()[100..150].fill(f64::NAN);
    runs[4].angle_rad[300..310].fill(f64::NAN);
    let log = write(&place, "log.h5", runs);
    diagnose(&place, &log, &rig(), "out").expect_code(0);
    let residuals = run_log::read_log(&place.path("out/residuals.h5")).unwrap();
    let missing = |run: usize, name: &str| {
        let values = &residuals.runs[run].extra(name).unwrap().values;
        values.iter().enumerate().filter(|(_, value)| value.is_nan()).map(|(row, _)| row).collect::<Vec<_>>()
    };
    assert_eq!(missing(3, "measured"), (100..150).collect::<Vec<_>>());
    assert!(missing(3, "predicted_before").is_empty() && missing(4, "predicted_before").is_empty());
}

#[test]
fn several_logs_are_one_and_runs_are_left_out() {
    let place = TestPlace::new();
    let runs = campaign(0.02);
    let (first, second) = runs.split_at(12);
    let one = write(&place, "one.h5", first.to_vec());
    let two = write(&place, "two.h5", second.to_vec());
    let (one, two) = (one.to_str().unwrap(), two.to_str().unwrap());
    let model = rig();
    let diagnose = |more: &[&str], out: &str| {
        let out = place.path(out);
        let arguments = ["diagnose", "--model", model.to_str().unwrap(), "--out", out.to_str().unwrap()];
        place.stepvalve(&[&arguments[..], more].concat())
    };
    let title = ["--title", "Two days <on> the rig"];
    diagnose(&[&["--log", one, "--log", two, "--exclude", "two:run-13"], &title[..]].concat(), "out")
        .expect_code(0);
    let found = json(&place, "out");
    assert_eq!(found["causes"][0]["id"], "pressure-dependent-friction", "{found}");
    let residuals = run_log::read_log(&place.path("out/residuals.h5")).unwrap();
    let names: Vec<&str> = residuals.runs.iter().map(|run| run.name.as_str()).collect();
    assert_eq!(names.len(), 23);
    assert!(names.contains(&"one:run-00") && names.contains(&"two:run-14") && !names.contains(&"two:run-13"));
    assert_eq!(residuals.angle_zero, AngleZero::Common);
    let page = std::fs::read_to_string(place.path("out/report.html")).unwrap();
    assert!(page.contains("<h1>Diagnosis: Two days &lt;on&gt; the rig</h1>"));
    // The same runs in one log are the same diagnosis.
    let whole = write(&place, "whole.h5", runs);
    diagnose(&["--log", whole.to_str().unwrap(), "--exclude", "run-13"], "whole").expect_code(0);
    let gain = |out: &str| json(&place, out)["causes"][0]["parameters"]["gain"]["value"].as_f64().unwrap();
    assert!((gain("out") / gain("whole") - 1.0).abs() < 1e-3, "{} and {}", gain("out"), gain("whole"));
    // What can't be: nothing is written.
    let none = place.path("none.h5");
    let cases: [(&[&str], &str); 3] = [
        (&["--log", one, "--exclude", "run-77"], "found no run run-77, expected one of run-00, run-01"),
        (&["--log", one, one], "another log is called one"),
        (&["--log", one, none.to_str().unwrap()], "none.h5"),
    ];
    for (arguments, says) in cases {
        let refused = diagnose(arguments, "refused").expect_code(2);
        assert!(refused.stderr.contains(says), "{}", refused.stderr);
        assert!(!place.path("refused").exists());
    }
}

/// Every rival has its numbers, and where it is asked for a model of its own that predicts as well.
#[test]
fn rivals_are_models_of_their_own() {
    let place = TestPlace::new();
    let speeds = [0.5, -0.9, 2.0, -4.0, 0.7, -0.6, 1.2, -1.5].into_iter().enumerate();
    let runs =
        speeds.map(|(number, speed)| sliding(&format!("run-{number}"), number as u64, speed, 10.0, 0.02));
    let log = write(&place, "log.h5", runs.collect());
    let (log, model, out) = (log.to_str().unwrap().to_owned(), rig(), place.path("out"));
    let arguments = [
        "diagnose",
        "--log",
        &log,
        "--model",
        model.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
        "--rivals",
    ];
    place.stepvalve(&arguments).expect_code(0);
    let found = json(&place, "out");
    assert_eq!(found["verdict"], "ambiguous", "{found}");
    let group = &found["ambiguous"][0];
    let ids = group["ids"].as_array().unwrap();
    let rivals = group["rivals"].as_array().unwrap();
    assert_eq!(ids.len(), rivals.len(), "{group}");
    for (id, rival) in ids.iter().zip(rivals) {
        assert_eq!(*id, rival["id"], "{group}");
        let numbers = rival["parameters"].as_object().unwrap();
        let correlated = rival["covariance"]["of"].as_array().unwrap().len();
        assert!(!numbers.is_empty() && correlated >= numbers.len(), "{rival}");
        let model = place.path(&format!("out/model-{}.toml", id.as_str().unwrap()));
        place.stepvalve(&["check", model.to_str().unwrap()]).expect_code(0);
        let again = format!("again-{}", id.as_str().unwrap());
        diagnose(&place, log.as_ref(), &model, &again).expect_code(0);
        assert_eq!(json(&place, &again)["verdict"], "no-discrepancy", "{id}");
    }
    // The page says the group in its headline, and what to do.
    look_at(&place.path("out/report.html"), "can't tell which of these it is");
    // A diagnosis is replaced if that is said, and what only the old one had goes.
    let rival = place.path(&format!("out/model-{}.toml", ids[0].as_str().unwrap()));
    let again = &arguments[..arguments.len() - 1];
    assert!(place.stepvalve(again).expect_code(2).stderr.contains("--force"));
    assert!(rival.exists());
    place.stepvalve(&[again, &["--force"]].concat()).expect_code(0);
    assert!(!rival.exists() && place.path("out/model-extended.toml").exists());
}

/// A number that is known exactly is set, and no cause; one that can't be set is refused with what can.
#[test]
fn numbers_are_fixed() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", campaign(0.0));
    let text = std::fs::read_to_string(rig()).unwrap();
    let off = text
        .replace("coulomb_torque_nm = 1.5 ", "coulomb_torque_nm = 1.2 ")
        .replace("static_torque_nm = 3.0 ", "static_torque_nm = 2.4 ");
    let model = place.write("model.toml", &off);
    let diagnose = |more: &[&str], out: &str| {
        let out = place.path(out);
        let arguments = ["diagnose", "--log", log.to_str().unwrap(), "--model", model.to_str().unwrap()];
        place.stepvalve(&[&arguments[..], &["--out", out.to_str().unwrap()], more].concat())
    };
    // More friction, or a transducer that reads too much: who knows the transducer exactly knows which.
    diagnose(&[], "off").expect_code(0);
    assert_eq!(json(&place, "off")["verdict"], "ambiguous");
    diagnose(&["--fix", "torque-gain.factor=1"], "gain").expect_code(0);
    let found = json(&place, "gain");
    assert_eq!(
        (&found["verdict"], &found["causes"][0]["id"]),
        (&"explained".into(), &"coulomb-level".into())
    );
    let fixed = ["--fix", "friction.coulomb_torque_nm=1.5", "--fix", "friction.static_torque_nm=3"];
    diagnose(&fixed, "fixed").expect_code(0);
    let found = json(&place, "fixed");
    assert_eq!(found["verdict"], "no-discrepancy", "{found}");
    let untestable = found["untestable"].as_array().unwrap();
    let level = untestable.iter().find(|of| of["id"] == "coulomb-level").expect("told as not asked");
    assert_eq!(level["reason"], "it was said to be known exactly");
    // A wrong number that is said to be known exactly isn't blamed: what it does is told of another.
    diagnose(&["--fix", "friction.static_torque_nm=2.4"], "wrong").expect_code(0);
    let wrong = json(&place, "wrong");
    assert!(!wrong["causes"].as_array().unwrap().iter().any(|of| of["id"] == "coulomb-level"), "{wrong}");
    diagnose(&["--fix", "torque-offset.offset_nm=0.2"], "offset").expect_code(0);
    let extended = std::fs::read_to_string(place.path("offset/model-extended.toml")).unwrap();
    assert!(extended.contains("torque-offset") && extended.contains("0.2"), "{extended}");
    let cases = [
        ("load.inertia", "expected SECTION.KEY=VALUE"),
        ("load.inertia=1", "expected one of friction.coulomb_torque_nm, friction.static_torque_nm"),
        ("friction.coulomb_torque_nm=-1", "coulomb_torque_nm"),
        ("position-torque.cos=1", "parameters: write it into the model"),
        ("torque-offset.gain=1", "expected offset_nm"),
        ("torque-gain.factor=x", "expected a number"),
    ];
    for (fix, says) in cases {
        let refused = diagnose(&["--fix", fix], "refused").expect_code(2);
        assert!(refused.stderr.contains(says) && refused.stderr.contains(fix), "{}", refused.stderr);
        assert!(!place.path("refused").exists());
    }
}

/// A recording of the loop has torque and command: its angle is what is predicted, in every file alike.
#[test]
fn a_recording_is_held_against_its_angle() {
    let place = TestPlace::new();
    let scenario = place.shortened("sine-1hz.toml", 2.0, &[]);
    place.simulate(&scenario, "in-process", "run").expect_code(0);
    diagnose(&place, &place.path("run/run.h5"), &rig(), "out").expect_code(0);
    let residuals = run_log::read_log(&place.path("out/residuals.h5")).unwrap();
    assert_eq!(residuals.attributes["predicted"], Attribute::Text("angle".to_owned()));
    let run = &residuals.runs[0];
    let of = |name: &str| run.extra(name).unwrap().values.as_slice();
    assert_eq!(of("measured"), run.angle_rad);
    let noise = json(&place, "out")["residual"][0]["noise"].as_f64().unwrap();
    let left = rms(of("measured"), of("predicted_before"));
    assert!(left < 2.0 * noise, "{left} rad, where the encoder scatters by {noise}");
}

/// A run as an instrument exports it: a preamble, a line of units, decimal commas; ms, degrees, N·cm and bar.
fn exported(run: &log_data::Run) -> String {
    let mut text =
        "Instrument;DAQ 4711\nOperator;nobody\n\nZeit;Winkel;Moment;Druck\nms;deg;Ncm;bar\n".to_owned();
    let (torque, pressure) = (run.torque_nm.as_ref().unwrap(), run.pressure_drop_pa.as_ref().unwrap());
    for row in 0..run.len() {
        let numbers = [
            1e3 * (run.time_s[row] - run.time_s[0]),
            run.angle_rad[row].to_degrees(),
            100.0 * torque[row],
            pressure[row] / 1e5,
        ];
        let cells = numbers.map(|number| format!("{number:.9}").replace('.', ","));
        text.push_str(&(cells.join(";") + "\n"));
    }
    text
}

/// The way of docs/import.md, from the instrument's tables to a cause; what is mapped wrongly at first is named on the way.
#[test]
fn from_the_tables_of_an_instrument_to_a_cause() {
    let place = TestPlace::new();
    let files: Vec<String> = campaign(0.02)
        .iter()
        .map(|run| place.write(&format!("{}.csv", run.name), &exported(run)).to_str().unwrap().to_owned())
        .collect();
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let path = |name: &str| place.path(name).to_str().unwrap().to_owned();
    let (model, recipe) = (rig().to_str().unwrap().to_owned(), path("daq.toml"));
    let import = |torque: &str, out: &str, more: &[&str]| {
        let table = ["--skip", "auto", "--units-line", "--decimal-comma", "--gap", "9"];
        let maps =
            ["--map", "time=Zeit/1000", "--map", "angle=Winkel*pi/180", "--map", "pressure_drop=Druck*1e5"];
        let rest = ["--map", torque, "--out", out];
        place.stepvalve(&[&["import"], &files[..], &table, &maps, &rest, more].concat()).expect_code(0);
    };
    let inspect = |log: &str| place.stepvalve(&["inspect", log, "--model", &model]);
    // As it is the table itself refuses it; one without units would not.
    import("torque=Moment*1", &path("wrong.h5"), &[]);
    let said = inspect(&path("wrong.h5")).expect_code(1).stdout;
    assert!(said.contains("is it in N*cm? Then --map torque='.../100'"), "{said}");
    let log = path("rig.h5");
    import("torque=Moment/100", &log, &["--save-recipe", &recipe]);
    inspect(&log).expect_code(0);
    diagnose(&place, log.as_ref(), &rig(), "found").expect_code(0);
    let found = json(&place, "found");
    assert_eq!(found["verdict"], "explained", "{found}");
    assert_eq!(found["causes"][0]["id"], "pressure-dependent-friction");
    // The next record in one word.
    let out = path("next.h5");
    let next = [&["import"], &files[..], &["--recipe", &recipe, "--out", &out]].concat();
    place.stepvalve(&next).expect_code(0);
    let runs = |name: &str| run_log::read_log(&place.path(name)).unwrap().runs;
    assert_eq!(runs("next.h5"), runs("rig.h5"));
}

/// One run without its pressure, one without most of its torque: the rest is judged, and the answer says what was not used.
#[test]
fn what_is_missing_in_some_runs_spoils_no_other() {
    let place = TestPlace::new();
    let mut runs = campaign(0.02);
    let all = runs.len();
    runs[1].pressure_drop_pa = None;
    runs[4].torque_nm.as_mut().unwrap()[..700].fill(f64::NAN);
    let log = write(&place, "log.h5", runs);
    diagnose(&place, &log, &rig(), "out").expect_code(0);
    let found = json(&place, "out");
    assert_eq!(found["causes"][0]["id"], "pressure-dependent-friction");
    let seen: Vec<&str> =
        found["observations"].as_array().unwrap().iter().map(|text| text.as_str().unwrap()).collect();
    let told = |words: &str| assert!(seen.iter().any(|text| text.contains(words)), "{words}: {seen:?}");
    // Without the pressure nothing explains the other runs; by those that have it the pressure does.
    told(&format!("1 of {all} runs are left out, since they have no pressure_drop: run-01"));
    told("run run-04 is used in rows 701 to 1000 alone: 700 of its 1000 samples of torque are missing");
    let residuals = run_log::read_log(&place.path("out/residuals.h5")).unwrap();
    assert_eq!(residuals.runs.len(), all - 1);
}

/// A zero that is off within its tolerance, where the given model has a zero of its own.
#[test]
fn a_given_offset_is_corrected_and_not_doubled() {
    let place = TestPlace::new();
    let log = write(&place, "log.h5", campaign(0.0));
    let given = std::fs::read_to_string(rig()).unwrap();
    let model =
        place.write("model.toml", &(given + "\n[[effect]]\nid = \"torque-offset\"\noffset_nm = 0.02\n"));
    diagnose(&place, &log, &model, "out").expect_code(0);
    let found = json(&place, "out");
    assert_eq!(found["verdict"], "no-discrepancy");
    let corrected = &found["within_tolerance"][0];
    assert_eq!((&corrected["id"], &corrected["at_bound"]), (&"torque-offset".into(), &false.into()));
    let extended = std::fs::read_to_string(place.path("out/model-extended.toml")).unwrap();
    assert!(extended.contains("Corrected within its tolerance: torque-offset"), "{extended}");
    let model = config::parse_model(&extended, "model-extended.toml").unwrap();
    let offset = model.effects.iter().find(|effect| effect.id() == EffectId::TorqueOffset).unwrap();
    assert!(offset.number("offset_nm").abs() < 2e-3, "{extended}");
    let residuals = run_log::read_log(&place.path("out/residuals.h5")).unwrap();
    let of = |name: &str| residuals.runs[0].extra(name).unwrap().values.clone();
    assert!(rms(&of("measured"), &of("predicted_after")) < 1.2 * NOISE_NM);
}

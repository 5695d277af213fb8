//! `stepvalve diagnose` on records of real drives that nobody made for it: skipped, loudly, where they are absent.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::{Log, Run};
use rand::prelude::*;
use rand_distr::Normal;
use serde_json::Value;
use std::path::{Path, PathBuf};
use stepvalve_tests::{TestPlace, measured_data};
use test_needs::there_and_back;

/// A model of friction with one level both ways: static Stribeck with T_s = T_c.
fn model(place: &TestPlace, inertia_kg_m2: f64, coulomb_nm: f64, viscous: f64) -> PathBuf {
    let text = format!(
        "format = \"stepvalve-model\"\nformat_version = 1\nname = \"symmetric\"\n[load]\ninertia_kg_m2 = {inertia_kg_m2:?}\n\
         [friction]\nlaw = \"stribeck\"\ncoulomb_torque_nm = {coulomb_nm:?}\nstatic_torque_nm = {coulomb_nm:?}\n\
         stribeck_velocity_rad_per_s = 0.1\nstribeck_exponent = 2.0\nregularisation_velocity_rad_per_s = 0.05\n\
         viscous_nm_s_per_rad = {viscous:?}\n"
    );
    place.write("model.toml", &text)
}

fn diagnosed(place: &TestPlace, log: &str, model: &Path, out: &str) -> Value {
    let paths = [&place.path(log), &model.to_owned(), &place.path(out)];
    let [log, model, folder] = paths.map(|path| path.to_str().unwrap().to_owned());
    let asked = ["diagnose", "--log", &log, "--model", &model, "--out", &folder, "--limit", "30min"];
    let finished = place.stepvalve(&asked);
    println!("{}", finished.expect_code(0).stdout);
    serde_json::from_slice(&std::fs::read(place.path(out).join("diagnosis.json")).unwrap()).unwrap()
}

fn names(found: &Value) -> Vec<&str> {
    found["causes"].as_array().unwrap().iter().map(|cause| cause["id"].as_str().unwrap()).collect()
}

fn parameter<'a>(found: &'a Value, id: &str, key: &str) -> &'a Value {
    let cause = found["causes"].as_array().unwrap().iter().find(|cause| cause["id"] == id);
    &cause.unwrap_or_else(|| panic!("no {id}: {found}"))["parameters"][key]
}

fn value(of: &Value) -> f64 {
    of["value"].as_f64().unwrap()
}

/// What the report says beside the causes, in one text.
fn said(found: &Value, key: &str) -> String {
    let all = found[key].as_array().unwrap().iter().map(|of| of.as_str().unwrap());
    all.collect::<Vec<_>>().join(" | ")
}

const METRE_PER_RAD: f64 = 0.0025 / std::f64::consts::TAU;

/// The carriage's record as log.h5, and the symmetric model that its authors fitted.
fn carriage(place: &TestPlace, data: &Path) -> PathBuf {
    let file = data.join("emps/DATA_EMPS.mat");
    let arguments = ["import", file.to_str().unwrap(), "--map", "time=t", "--map", "angle=qm*2*pi/0.0025"];
    let log = place.path("log.h5");
    let more = ["--map", "torque=gtau*vir*0.0025/(2*pi)", "--out", log.to_str().unwrap()];
    place.stepvalve(&[&arguments[..], &more].concat()).expect_code(0);
    let square = METRE_PER_RAD * METRE_PER_RAD;
    model(place, 95.1089 * square, 20.3935 * METRE_PER_RAD, 203.5034 * square)
}

/// A carriage on a screw of 2.5 mm pitch (Janot, Gautier and Brunot, EMPS): a symmetric model misses that its viscous
/// friction differs by direction, and a ripple of about 1 N once per turn whose phase drifts with speed.
#[test]
fn a_carriage_on_a_screw() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let model = carriage(&place, &data);
    let found = diagnosed(&place, "log.h5", &model, "out");
    let mut named = names(&found);
    named.sort_unstable();
    // The record's force is the controller's command, which is held for a millisecond and then goes through the amplifier:
    // it leads. A regression of the force away from reversals on motion and its own derivative has 0.75 to 0.85 ms, in
    // either half and either direction.
    if let Some(place) = named.iter().position(|id| *id == "sensor-delay") {
        named.remove(place);
        let delay_s = value(parameter(&found, "sensor-delay", "delay_s"));
        assert!((-1e-3..0.0).contains(&delay_s), "{delay_s} s");
    }
    assert_eq!(named, ["direction-asymmetry"], "nothing else, above all no Stribeck");
    // 167 against 240 N·s/m: −0.18; the levels hardly differ.
    let viscous = value(parameter(&found, "direction-asymmetry", "viscous"));
    assert!((-0.195..-0.165).contains(&viscous), "{viscous}");
    let level = parameter(&found, "direction-asymmetry", "level");
    assert!(level["value"].as_f64().unwrap_or(0.0).abs() < 0.06, "{level}");
    let offered = &found["offered"][0];
    assert_eq!(offered["id"], "position-torque", "{found}");
    let ripple = |key: &str| value(&offered["parameters"][key]) / METRE_PER_RAD;
    let newton = ripple("cos[1]").hypot(ripple("sin[1]"));
    assert!((0.9..1.1).contains(&newton), "{newton} N");
    // A torque over the angle would have one phase: it is told, and offered, and not in the model.
    let seen = said(&found, "observations");
    for part in
        ["position-torque is there", "once per turn drifts with speed", "kept out of the extended model"]
    {
        assert!(seen.contains(part), "{part:?} is not in {seen}");
    }
    let extended = std::fs::read_to_string(place.path("out/model-extended.toml")).unwrap();
    let in_the_model = extended.lines().filter(|line| !line.trim_start().starts_with('#'));
    assert!(
        extended.contains("position-torque")
            && !in_the_model.clone().any(|line| line.contains("position-torque"))
    );
}

/// Found in one half of the carriage's record and scored on the other, both ways: relative error of the force in per cent,
/// measured and predicted filtered alike, with what is written into the model. Direction asymmetry alone gives 3.07 to 3.09.
#[test]
fn a_carriage_found_in_one_half_and_scored_on_the_other() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let model = carriage(&place, &data);
    let whole = run_log::read_log(&place.path("log.h5")).unwrap();
    let middle = whole.runs[0].len() / 2;
    for (name, rows) in [("first", 0..middle), ("second", middle..whole.runs[0].len())] {
        let run = &whole.runs[0];
        let cut = |values: &[f64]| values[rows.clone()].to_vec();
        let half = Run {
            name: name.to_owned(),
            time_s: cut(&run.time_s),
            angle_rad: cut(&run.angle_rad),
            torque_nm: run.torque_nm.as_deref().map(cut),
            ..Run::default()
        };
        let log = Log { title: name.to_owned(), runs: vec![half], ..Log::default() };
        run_log::write_log(&place.path(&format!("{name}.h5")), &log).unwrap();
    }
    for (fitted, other) in [("first", "second"), ("second", "first")] {
        let found = diagnosed(&place, &format!("{fitted}.h5"), &model, fitted);
        let (log, extended) =
            (place.path(&format!("{other}.h5")), place.path(fitted).join("model-extended.toml"));
        let given = relative_error(&place, &log, &model);
        let after = relative_error(&place, &log, &extended);
        println!(
            "found in the {fitted} half, scored on the other: {after:.3} % (symmetric model {given:.3} %)"
        );
        assert!(after < 3.08, "{after} %: {:?}", names(&found));
    }
}

/// 100·‖T − T̂‖/‖T‖, both filtered by a Butterworth filter of order 4 at 100 Hz there and back, every tenth sample. The
/// record's first ten samples are left out: a prediction begins with the first, and knows nothing of what was before.
fn relative_error(place: &TestPlace, log: &Path, model: &Path) -> f64 {
    let out = place.path("scored.h5");
    let [log_path, model, out_path] = [log, model, &out].map(|path| path.to_str().unwrap().to_owned());
    let arguments = ["predict", "--log", &log_path, "--model", &model, "--out", &out_path];
    place.stepvalve(&arguments).expect_code(0);
    let torque = |path: &Path| {
        let torque = run_log::read_log(path).unwrap().runs[0].torque_nm.clone().unwrap();
        let filtered = there_and_back(&torque[10..]);
        filtered.into_iter().step_by(10).collect::<Vec<f64>>()
    };
    let (measured, predicted) = (torque(log), torque(&out));
    std::fs::remove_file(&out).unwrap();
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>().sqrt();
    let error = norm(&mut measured.iter().zip(&predicted).map(|(a, b)| a - b));
    100.0 * error / norm(&mut measured.iter().copied())
}

/// The seal's records, three repetitions, with or without what pressure it was under, as log.h5.
fn seal(place: &TestPlace, data: &Path, with_pressure: bool) -> PathBuf {
    seal_in(place, data, "", with_pressure)
}

/// The same of one repetition, `1_` to `3_`, or of all.
fn seal_in(place: &TestPlace, data: &Path, repetition: &str, with_pressure: bool) -> PathBuf {
    let mut files: Vec<String> = std::fs::read_dir(data.join("seal-friction"))
        .unwrap()
        .map(|file| file.unwrap())
        .filter(|file| file.file_name().to_str().unwrap().starts_with(repetition))
        .map(|file| file.path().to_str().unwrap().to_owned())
        .collect();
    files.sort();
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let maps = ["--map", "time=c1/1000", "--map", "angle=c5/12.5", "--map", "torque=c7*0.0125"];
    let pressure: &[&str] = if with_pressure { &["--map", "pressure_drop=c6*1e5"] } else { &[] };
    let log = place.path("log.h5");
    let fixed = ["--gap", "60", "--kind", "constant-velocity", "--out", log.to_str().unwrap()];
    place.stepvalve(&[&["import"], &files[..], &maps, pressure, &fixed].concat()).expect_code(0);
    model(place, 0.0, SEAL_NM, 0.0)
}

/// The one friction level that the model has for all pressures, N·m, and the seal's radius, m.
const SEAL_NM: f64 = 0.06;
const SEAL_M: f64 = 0.0125;

/// An O-ring under four pressures, three times: the piston's area in the torque, friction that rises with pressure, and a drive
/// that extends the more slowly the higher the pressure is.
#[test]
fn a_seal_under_pressure() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let model = seal(&place, &data, true);
    let found = diagnosed(&place, "log.h5", &model, "out");
    let named = names(&found);
    assert!(named.contains(&"pressure-torque"), "{named:?}");
    assert!(named.contains(&"pressure-dependent-friction"), "{named:?}");
    // N·m/MPa as N/bar.
    let area = value(parameter(&found, "pressure-torque", "gain")) / SEAL_M / 10.0;
    assert!((51.0..53.0).contains(&area), "{area} N/bar");
    assert!(!named.contains(&"wear-drift"), "at 1 bar the friction comes back to its first value: {named:?}");
    let gain = parameter(&found, "pressure-dependent-friction", "gain");
    let newton_per_bar = |gain: &Value| gain.as_f64().unwrap() * SEAL_NM / SEAL_M / 10.0;
    let slope = newton_per_bar(&gain["value"]);
    let (low, high) = (newton_per_bar(&gain["ci95"][0]), newton_per_bar(&gain["ci95"][1]));
    println!("friction rises by {slope:.3} N/bar ({low:.3} to {high:.3})");
    assert!((0.2..0.65).contains(&slope), "{slope} N/bar");
    // Repetition 1 gives 0.56 and repetition 2 0.26: what is known of the slope is no better than that.
    assert!(low > 0.0 && high - low >= 0.30, "{low} to {high} N/bar");
    let seen = said(&found, "observations");
    assert!(seen.contains("speed in the positive direction falls with pressure"), "{seen}");
    let page = std::fs::read_to_string(place.path("out/report.html")).unwrap();
    assert!(page.contains("speed in the positive direction falls with pressure"));
}

/// One repetition alone goes through its pressures once, so that friction may have risen with any of what else rises. Laws over the time and the
/// speed follow it as well; they don't take the place of the listed causes that it may be.
#[test]
fn a_seal_under_pressure_once() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let model = seal_in(&place, &data, "1_", true);
    let found = diagnosed(&place, "log.h5", &model, "out");
    assert_eq!(names(&found), ["pressure-torque"], "{}", found["ambiguous"]);
    let group: Vec<&str> =
        found["ambiguous"][0]["ids"].as_array().unwrap().iter().map(|id| id.as_str().unwrap()).collect();
    assert!(group.contains(&"pressure-dependent-friction"), "{group:?}");
}

/// The same, the pressure withheld: friction and offset differ between runs, and no cause of the list is to blame.
#[test]
fn a_seal_whose_pressure_was_not_recorded() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let model = seal(&place, &data, false);
    let found = diagnosed(&place, "log.h5", &model, "out");
    assert_eq!(names(&found), [""; 0], "{found}");
    assert_eq!(found["verdict"], "unexplained", "{found}");
    let seen = said(&found, "observations");
    for part in ["Friction and offset differ between runs", "these data can't say", "pressure_drop"] {
        assert!(seen.contains(part), "{part:?} is not in {seen}");
    }
    // 52.2 N/bar at the radius, under 1, 3, 5 and 7 bar: a standard deviation of 1.46 N·m over all runs, 1.52 as that of a sample.
    let offset = seen.split("the offset by ±").nth(1).and_then(|rest| rest.split(' ').next());
    let offset_nm: f64 = offset.and_then(|number| number.parse().ok()).unwrap();
    assert!((1.40..1.60).contains(&offset_nm), "{offset_nm} N·m");
    let page = std::fs::read_to_string(place.path("out/report.html")).unwrap();
    assert!(page.contains("Friction and offset differ between runs"));
}

/// Whether a torque offset is named, alone or in a group that holds it.
fn blames_an_offset(found: &Value) -> bool {
    let mut grouped =
        found["ambiguous"].as_array().unwrap().iter().flat_map(|group| group["ids"].as_array().unwrap());
    names(found) == ["torque-offset"] || grouped.any(|id| id == "torque-offset")
}

/// A motor on a screw that starts and stops at 50 and 200 rpm, forwards and backwards, with 2.55 and 3.23 mN·m by hand. For half
/// of the time it stands, and its drive gives no torque at all.
#[test]
fn a_drive_that_starts_and_stops() {
    let Some(data) = measured_data() else { return };
    let place = TestPlace::new();
    let runs = ["50", "200"].map(|name| data.join(format!("screw-drive/start_stop/{name}.csv")));
    let recipe = stepvalve_tests::repository().join("rt-config/recipes/screw-drive.toml");
    let log = place.path("log.h5");
    let paths = [&runs[0], &runs[1], &recipe, &log].map(|path| path.to_str().unwrap());
    place.stepvalve(&["import", paths[0], paths[1], "--recipe", paths[2], "--out", paths[3]]).expect_code(0);
    let model = model(&place, 1e-7, 2.89e-3, 2.35e-5);
    assert!(blames_an_offset(&diagnosed(&place, "log.h5", &model, "out")));
}

/// The same of a drive that nobody recorded: friction alone holds the axis between motions, and a law without bristles says
/// nothing of the torque there. Samples at rest neither speak against an offset nor make its noise.
#[test]
fn a_torque_at_rest_says_nothing_to_a_law_without_bristles() {
    let place = TestPlace::new();
    let mut generator = rand_pcg::Pcg64::seed_from_u64(41);
    let mut noise = |deviation: f64| Normal::new(0.0, deviation).unwrap().sample(&mut generator);
    let (step_s, motion) = (0.02, 75);
    let mut run = Run { name: "start-stop".to_owned(), ..Run::default() };
    let (mut angle_rad, mut torque_nm) = (0.0, Vec::new());
    for stretch in 0..24 {
        let speed: f64 = [0.0, 40.0, 0.0, -40.0][stretch % 4];
        // Each motion differs by a little from the others.
        let level = 0.02 * speed.signum() + 4e-5 * speed - 2.5e-3 + noise(1e-3);
        for _ in 0..motion {
            angle_rad += speed * step_s;
            run.time_s.push(run.time_s.len() as f64 * step_s);
            run.angle_rad.push(angle_rad);
            torque_nm.push(if speed == 0.0 { 0.0 } else { level + noise(1.5e-3) });
        }
    }
    run.torque_nm = Some(torque_nm);
    let log = Log { title: "a drive".to_owned(), runs: vec![run], ..Log::default() };
    run_log::write_log(&place.path("log.h5"), &log).unwrap();
    let model = model(&place, 1e-7, 0.02, 4e-5);
    assert!(blames_an_offset(&diagnosed(&place, "log.h5", &model, "out")));
}

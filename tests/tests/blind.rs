//! Blind tests of `stepvalve diagnose`: it is handed a log and the nominal model, and has to find what a rig hides that
//! shares no friction code with it.
//!
//! Each state of the diagnosis' and the rig's sources draws other seeds, so that a commit which touches neither repeats what
//! the one before was measured with; `STEPVALVE_BLIND_SEED` (printed) repeats or changes them. Single findings are a matter
//! of chance, so what is required is how many of a score are right.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use hidden_effect_rig::{
    Campaign, Family, Finding, Hidden, Interval, LogKind, OUTSIDE, Outcome, STRONG, WEAK, choose, intervals,
};
use serde_json::Value;
use std::path::{Path, PathBuf};
use stepvalve_tests::{TestPlace, count, nothing_hidden, repository, ten_strong_effects};

/// Samples of a campaign: fewer than in the field, so that a score of them takes minutes.
const SAMPLES: usize = 24_000;

/// The first seed: as given, else the sources' own.
fn first_seed() -> u64 {
    let given = std::env::var("STEPVALVE_BLIND_SEED").ok().and_then(|text| text.parse().ok());
    let seed = given.unwrap_or_else(|| {
        let folders = ["crates/diagnosis/src", "tests/rig/src"].map(|folder| repository().join(folder));
        let mut sources: Vec<PathBuf> = folders.iter().flat_map(|folder| files_below(folder)).collect();
        sources.sort();
        u64::from(
            sources.iter().fold(0, |sum, path| crc32c::crc32c_append(sum, &std::fs::read(path).unwrap())),
        )
    });
    eprintln!("seeds from STEPVALVE_BLIND_SEED={seed} on");
    seed
}

/// The files of a folder and of those within it.
fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files_below(&path) } else { vec![path] }).collect()
}

/// Draws a short campaign and has it diagnosed.
fn diagnosed(seed: u64, hidden: &Hidden) -> (Campaign, Value) {
    diagnosed_as_long(seed, &Hidden { samples: SAMPLES, ..hidden.clone() })
}

/// ... one as long as the rig draws them.
fn diagnosed_as_long(seed: u64, hidden: &Hidden) -> (Campaign, Value) {
    let campaign = Campaign::draw(seed, hidden);
    let place = TestPlace::new();
    let given = place.path("given");
    campaign.write(&given).unwrap();
    // The tool may know the log and the model; the truth stays here.
    std::fs::remove_file(given.join("truth.json")).unwrap();
    let (log, model, out) = (given.join("log.h5"), given.join("model.toml"), place.path("found"));
    let paths = [&log, &model, &out].map(|path| path.to_str().unwrap().to_owned());
    // The exact family's models are exact but for what is hidden.
    let tolerance: &[&str] = if hidden.family == Family::Exact { &["--tolerance", "0"] } else { &[] };
    let arguments =
        ["diagnose", "--log", &paths[0], "--model", &paths[1], "--out", &paths[2], "--limit", "30min"];
    place.stepvalve(&[&arguments[..], tolerance].concat()).expect_code(0);
    let text = std::fs::read(out.join("diagnosis.json")).unwrap();
    (campaign, serde_json::from_slice(&text).unwrap())
}

/// Has a campaign diagnosed and judges the finding, which is printed.
fn found(seed: u64, hidden: &Hidden) -> Outcome {
    let (campaign, diagnosis) = diagnosed(seed, hidden);
    let finding = Finding::of(&diagnosis);
    let outcome = finding.judge(&campaign.truth);
    eprintln!(
        "seed {seed}, {:?} log, {:?} hidden: {outcome:?}: {}, named {:?}, groups {:?}",
        hidden.log, hidden.effects, finding.verdict, finding.named, finding.groups
    );
    outcome
}

#[test]
fn strong_effects_are_named() {
    let seed = first_seed();
    let outcomes = ten_strong_effects(seed, found);
    assert!(count(&outcomes, Outcome::Right) >= 7, "{outcomes:?}");
    assert!(count(&outcomes, Outcome::Wrong) <= 2, "{outcomes:?}");
}

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    let seed = first_seed() + 100;
    let outcomes = nothing_hidden(4, seed, found);
    assert!(count(&outcomes, Outcome::Right) >= 3, "{outcomes:?}");
}

#[test]
fn two_at_once_and_what_is_outside_the_list() {
    let seed = first_seed() + 200;
    let pairs = [["pressure-torque", "viscous-level"], ["position-torque", "coulomb-level"]];
    let two: Vec<Outcome> = pairs
        .iter()
        .zip(seed..)
        .map(|(pair, seed)| found(seed, &Hidden::with(LogKind::Torque, pair, STRONG)))
        .collect();
    assert!(count(&two, Outcome::Right) >= 1, "{two:?}");
    let outside: Vec<Outcome> = (seed + 10..seed + 13)
        .map(|seed| found(seed, &Hidden::with(LogKind::Torque, &[choose(seed, OUTSIDE)], STRONG)))
        .collect();
    assert!(count(&outside, Outcome::Wrong) <= 1, "{outside:?}");
}

/// More friction and more holding torque leave the lag as it is: alone, neither explains anything.
#[test]
fn two_that_hide_each_other() {
    let pair = ["pressure-dependent-friction", "holding-torque-level"];
    assert_eq!(found(70_438, &Hidden::with(LogKind::Angle, &pair, STRONG)), Outcome::Right);
}

/// Alone, either does as much; beside each other, both pay, and neither stands for the other.
#[test]
fn two_of_which_either_does_as_much_alone() {
    let pair = ["viscous-level", "pressure-dependent-friction"];
    let (campaign, diagnosis) = diagnosed_as_long(110_436, &Hidden::with(LogKind::Angle, &pair, STRONG));
    assert_eq!(Finding::of(&diagnosis).judge(&campaign.truth), Outcome::Right);
}

/// Where a rotor sticks and slips, stiffer bristles show nothing of themselves until they are as stiff as the truth.
#[test]
fn a_needle_in_a_rough_floor_is_found() {
    let pair = ["wear-drift", "bristle-stiffness"];
    assert_eq!(found(99_357, &Hidden::with(LogKind::Angle, &pair, STRONG)), Outcome::Right);
}

/// A lag of two stages, which a model of one leaves with 2.3 times the noise.
#[test]
fn a_lag_of_two_stages_is_fitted_to_the_noise() {
    let hidden = Hidden::with(LogKind::Torque, &["friction-lag"], STRONG);
    let (campaign, diagnosis) = diagnosed(190_056, &hidden);
    assert_eq!(Finding::of(&diagnosis).judge(&campaign.truth), Outcome::Right);
    let left = diagnosis["gain"]["rms_after"].as_f64().unwrap() / campaign.truth.noise;
    assert!(left < 1.2, "{left} times the noise is left");
}

/// A weak effect that leaves a tenth more than the noise: a small change of it tells nothing of slips, a large one does.
#[test]
fn a_weak_effect_that_moves_slips_is_found() {
    assert_eq!(found(180_395, &Hidden::with(LogKind::Angle, &["direction-asymmetry"], WEAK)), Outcome::Right);
}

/// Two series follow a gear's torque within the angles visited: the second picks from what the first one leaves.
#[test]
fn what_is_geared_to_the_spool_is_no_series_over_its_angle() {
    let hidden = Hidden::with(LogKind::Torque, &["outside-gear"], STRONG);
    let (campaign, diagnosis) = diagnosed_as_long(210_209, &Hidden { samples: 48_000, ..hidden });
    assert_eq!(Finding::of(&diagnosis).judge(&campaign.truth), Outcome::Right);
}

/// A tone that is there at rest too counts as noise, but is none.
#[test]
fn a_hum_is_heard() {
    assert_eq!(found(80_208, &Hidden::with(LogKind::Torque, &["outside-hum"], STRONG)), Outcome::Right);
}

/// Every interval of a single strong effect holds the truth.
fn intervals_hold(seed: u64, log: LogKind, effect: &str) {
    let (campaign, diagnosis) = diagnosed(seed, &Hidden::with(log, &[effect], STRONG));
    let intervals = intervals(&campaign.truth, &diagnosis, true);
    assert!(!intervals.is_empty() && intervals.iter().all(Interval::holds), "{seed}: {intervals:?}");
}

/// What the encoder makes of a number is part of its interval; and a delay of fast swings comes out as long as it is.
#[test]
fn an_interval_holds_the_truth_where_it_once_did_not() {
    intervals_hold(92_002, LogKind::Torque, "static-level");
    intervals_hold(97_191, LogKind::Torque, "sensor-delay");
}

/// A fit ends in its valley though a rotor slips at other moments with every change.
#[test]
#[ignore = "gain and time constant miss by 2.2 and 2.7 standard errors where the fit frees the exponent, in 3 of 5 draws of runs held out"]
fn an_interval_holds_the_truth_of_a_lock_in_a_rotor_that_slips() {
    intervals_hold(97_398, LogKind::Angle, "hydraulic-lock");
}

/// The rig with nothing hidden is the nominal model, computed in another way: the prediction leaves its noise alone.
#[test]
fn rig_and_prediction_agree_where_nothing_is_hidden() {
    let seed = first_seed() + 300;
    for (log, seed) in [LogKind::Torque, LogKind::Angle].into_iter().zip(seed..) {
        let campaign = Campaign::draw(seed, &Hidden::none(log));
        let place = TestPlace::new();
        campaign.write(&place.path("given")).unwrap();
        let paths = ["given/log.h5", "given/model.toml", "out.h5"].map(|path| place.path(path));
        let paths = paths.map(|path| path.to_str().unwrap().to_owned());
        let arguments = ["predict", "--log", &paths[0], "--model", &paths[1], "--out", &paths[2]];
        place.stepvalve(&arguments).expect_code(0);
        let predicted = run_log::read_log(&place.path("out.h5")).unwrap();
        let (mut square, mut count) = (0.0, 0);
        for run in &campaign.log.runs {
            let found = predicted.run(&run.name).unwrap();
            let (measured, found) = match log {
                LogKind::Torque => (run.torque_nm.as_ref().unwrap(), found.torque_nm.as_ref().unwrap()),
                LogKind::Angle => (&run.angle_rad, &found.angle_rad),
            };
            let own: f64 = measured.iter().zip(found).map(|(a, b)| (a - b).powi(2)).sum();
            let length = measured.len();
            // A torque predicted from a shaken spool is its inertia times what the encoder's noise makes of the acceleration.
            if log == LogKind::Torque && run.kind == "shake" {
                let ratio = (own / length as f64).sqrt() / campaign.truth.noise;
                assert!((0.9..4.0).contains(&ratio), "seed {seed}, {}: {ratio}", run.name);
                continue;
            }
            (square, count) = (square + own, count + length);
        }
        let ratio = (square / count as f64).sqrt() / campaign.truth.noise;
        eprintln!("seed {seed}, {log:?} log: residual over noise {ratio:.3}");
        assert!((0.97..1.08).contains(&ratio), "seed {seed}, {log:?}: {ratio}");
    }
}

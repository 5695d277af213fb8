//! Every model and scenario file that comes with the product is valid, and each scenario with its models too.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::fs;
use std::path::{Path, PathBuf};

fn files(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rt-config").join(folder);
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    files
}

fn model(path: &Path) -> valve_model::Model {
    config::parse_model(&fs::read_to_string(path).unwrap(), &path.display().to_string())
        .unwrap_or_else(|errors| panic!("{errors}"))
}

#[test]
fn models_are_valid_and_survive_writing() {
    let paths = files("models");
    assert!(paths.len() >= 3, "{paths:?}");
    for path in paths {
        let model = model(&path);
        let written = config::write_model(&model, &config::ModelComments::new());
        assert_eq!(config::parse_model(&written, "written").unwrap(), model);
    }
}

#[test]
fn scenarios_are_valid_with_their_models() {
    let mut names = Vec::new();
    for path in files("scenarios") {
        let (text, file) = (fs::read_to_string(&path).unwrap(), path.display().to_string());
        let scenario = config::parse_scenario(&text, &file).unwrap_or_else(|errors| panic!("{errors}"));
        let folder = path.parent().unwrap();
        let (truth, belief) = (model(&folder.join(&scenario.truth)), model(&folder.join(&scenario.belief)));
        config::check_against_models(&scenario, &truth, &belief, &text, &file)
            .unwrap_or_else(|errors| panic!("{errors}"));
        assert_eq!(scenario.safety.silence_cycles, 50, "{file}");
        // The paper's two put the following error out of reach on purpose: lost steps are to end them. `check` says so.
        let is_unwatched = scenario.safety.max_following_error_rad > std::f64::consts::TAU;
        let warnings = scenario.warnings();
        assert_eq!(is_unwatched, file.contains("/paper-"), "{file}");
        assert_eq!(warnings.len(), usize::from(is_unwatched), "{file}: {warnings:?}");
        assert!(warnings.iter().all(|warning| warning.contains("never a fault")), "{file}: {warnings:?}");
        assert!(text.starts_with('#'), "{file} says what it shows");
        names.push(path.file_stem().unwrap().to_str().unwrap().to_owned());
    }
    let expected = [
        "flow-steps",
        "paper-initial",
        "paper-revised",
        "rotation-200khz",
        "rotation-600khz",
        "sine-1hz",
        "step-sequence",
    ];
    for name in expected {
        assert!(names.iter().any(|found| found == name), "{name} is missing among {names:?}");
    }
}

/// `Model::bench_rig` has the numbers of the file, so that examples and unit tests speak of the rig that is shipped.
#[test]
fn the_bench_rig_in_code_is_the_one_in_the_file() {
    let shipped = files("models").into_iter().find(|path| path.ends_with("rig.toml")).unwrap();
    let shipped = model(&shipped);
    let in_code = valve_model::Model::bench_rig();
    assert_eq!(in_code.motor, shipped.motor);
    assert_eq!(in_code.load, shipped.load);
    assert_eq!(in_code.friction, shipped.friction);
}

//! What MATLAB users read our files with (tools/matlab), in GNU Octave.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use hidden_effect_rig::{Campaign, Hidden, LogKind};
use log_data::Channel;
use serde_json::Value;
use std::process::{Command, Stdio};
use stepvalve_tests::{Finished, TestPlace, repository};
use test_needs::skip_without;

const MODEL: &str = r#"format = "stepvalve-model" # what it is
format_version = 1
name = "with \"quotes\" # and a hash"

[friction]
law = "lugre"
coulomb_torque_nm = 1.25

[[effect]]
id = "angle-dependent-friction"
cosine = [0.0, 0.125, # the second order
          -2.5e-3]
sine = []

[[effect]]
id = "torque-gain"
factor = 0.975
"#;

fn has_octave() -> bool {
    let asked =
        Command::new("octave-cli").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    let there = asked.is_ok_and(|status| status.success());
    if !there {
        skip_without("GNU Octave (octave-cli)");
    }
    there
}

/// The lines that a script of tests/octave prints.
fn octave(files: &[&str]) -> Finished {
    let script = repository().join("tests/octave/read_all.m");
    Command::new("octave-cli").args(["--no-gui", "-q"]).arg(script).args(files).output().unwrap().into()
}

#[test]
fn octave_reads_runs_diagnosis_and_model_as_they_were_written() {
    if !has_octave() {
        return;
    }
    let place = TestPlace::new();
    let campaign = Campaign::draw(3, &Hidden { samples: 12_000, ..Hidden::none(LogKind::Torque) });
    campaign.write(&place.path("rig")).unwrap();
    let path = |name: &str| place.path(name).to_str().unwrap().to_owned();
    let (log, out) = (path("rig/log.h5"), path("out"));
    let arguments =
        ["diagnose", "--log", &log, "--model", &path("rig/model.toml"), "--out", &out, "--limit", "30min"];
    place.stepvalve(&arguments).expect_code(0);
    place.write("model.toml", MODEL);
    let read = octave(&[&log, &path("out/diagnosis.json"), &path("model.toml")]);
    let lines: Vec<Vec<&str>> = read.stdout.lines().map(|line| line.split(' ').collect()).collect();
    let number = |text: &str| text.parse::<f64>().unwrap();

    let runs: Vec<&Vec<&str>> = lines.iter().filter(|line| line[0] == "run").collect();
    assert_eq!(runs.len(), campaign.log.runs.len(), "{}{}", read.stdout, read.stderr);
    for run in &campaign.log.runs {
        let named = |line: &&&Vec<&str>| line[1].replace('_', "") == run.name.replace(['_', '-', ' '], "");
        let line =
            runs.iter().find(named).unwrap_or_else(|| panic!("no run {} in {}", run.name, read.stdout));
        let torque: f64 = run.channel(Channel::Torque).unwrap().iter().sum();
        assert_eq!(line[2].parse::<usize>().unwrap(), run.len());
        assert_eq!(number(line[3]).to_bits(), run.angle_rad.last().unwrap().to_bits());
        // Added up in another order.
        assert!((number(line[4]) - torque).abs() < 1e-9 * run.len() as f64, "{} {torque}", line[4]);
    }

    let text = std::fs::read_to_string(place.path("out/diagnosis.json")).unwrap();
    let diagnosis: Value = serde_json::from_str(&text).unwrap();
    let line = lines.iter().find(|line| line[0] == "diagnosis").unwrap();
    assert_eq!(line[1], diagnosis["verdict"].as_str().unwrap());
    assert_eq!(number(line[2]), diagnosis["gain"]["rms_before"].as_f64().unwrap());

    for expected in ["model lugre 1.25", "effect torque-gain factor 0.97499999999999998"] {
        assert!(read.stdout.contains(expected), "{expected} is not in {}", read.stdout);
    }
    let cosine = "effect angle-dependent-friction cosine 0 0.125 -0.0025000000000000001 sine";
    assert!(read.stdout.contains(cosine), "{}", read.stdout);

    // The extended model that the program itself wrote.
    let read = octave(&[&log, &path("out/diagnosis.json"), &path("out/model-extended.toml")]);
    assert!(read.stdout.contains("model "), "{}{}", read.stdout, read.stderr);

    for (text, line, found) in [
        ("[friction\n", 2, "[friction"),
        ("[friction]\nnot a line\n", 3, "not a line"),
        ("a = 1 2\n", 2, "a = 1 2"),
    ] {
        place.write("bad.toml", &format!("format = \"stepvalve-model\"\n{text}"));
        let read = octave(&[&log, &path("out/diagnosis.json"), &path("bad.toml")]);
        let expected = format!("bad.toml:{line}: found `{found}`");
        assert!(read.stderr.contains(&expected), "{expected} is not in {}{}", read.stdout, read.stderr);
    }
}

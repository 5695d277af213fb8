//! What others read our files with: h5py, and MCAP's public Python reader.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::path::PathBuf;
use std::process::Command;
use stepvalve_tests::{Finished, despite_stalls, repository};
use test_needs::python;

/// What the scripts in tools/ import.
const MODULES: [&str; 4] = ["h5py", "matplotlib", "mcap", "mcap_ros2"];

#[test]
fn run_files_and_records_open_in_python() {
    let Some(python) = python(&MODULES) else { return };
    despite_stalls(|place| {
        let scenario = place.scenario("flow-steps.toml", &[]);
        place.simulate(&scenario, "realtime", "out").expect_code(0);
        let run = |script: &str, arguments: &[PathBuf]| {
            let output =
                Command::new(&python).arg(repository().join("tools").join(script)).args(arguments).output();
            Finished::from(output.unwrap()).expect_code(0)
        };
        run("plot_run.py", &[place.path("out/run.h5"), place.path("run.png")]);
        let png = std::fs::read(place.path("run.png")).unwrap();
        assert!(png.starts_with(b"\x89PNG") && png.len() > 20_000, "{} bytes", png.len());
        let read = run("read_mcap.py", &[place.path("out/run-0001.mcap")]);
        for topic in
            ["/feedback", "/reference", "/step_command", "/control_status", "/plant_truth", "/loop_timing"]
        {
            assert!(read.stdout.contains(topic), "{topic} is not in {}", read.stdout);
        }
    });
}

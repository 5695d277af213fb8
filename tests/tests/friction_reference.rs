//! The friction torque of given motions against an independent solver: SciPy's Radau at rtol 1e-9.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::path::PathBuf;
use std::process::{Command, Stdio};
use stepvalve_tests::{Finished, repository};

#[test]
fn friction_agrees_with_scipy() {
    let python = std::env::var_os("STEPVALVE_PYTHON")
        .map_or_else(|| repository().join("tools/.venv/bin/python"), PathBuf::from);
    let works = Command::new(&python).args(["-c", "import scipy.integrate"]).output();
    if !works.is_ok_and(|output| output.status.success()) {
        println!("SKIPPED: {} has no SciPy; tools/check installs it", python.display());
        return;
    }
    let mut trace = Command::new(env!("CARGO"))
        .args(["run", "--quiet", "--package", "valve-model", "--example", "friction_trace"])
        .current_dir(repository())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let checked = Command::new(&python)
        .arg(repository().join("tools/reference_friction.py"))
        .stdin(trace.stdout.take().unwrap())
        .output();
    assert!(trace.wait().unwrap().success());
    let checked = Finished::from(checked.unwrap()).expect_code(0);
    println!("{}", checked.stdout);
    // Seven cases, each with a verdict.
    assert_eq!(checked.stdout.lines().filter(|line| line.ends_with("ok")).count(), 7, "{}", checked.stdout);
}

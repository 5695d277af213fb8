//! The friction torque of given motions against an independent solver: SciPy's Radau at rtol 1e-9.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::process::{Command, Stdio};
use stepvalve_tests::{Finished, repository};
use test_needs::python;

#[test]
fn friction_agrees_with_scipy() {
    let Some(python) = python(&["scipy.integrate"]) else { return };
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

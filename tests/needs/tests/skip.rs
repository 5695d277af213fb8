//! The rule for skipped tests, seen as a developer and CI see it: this program runs its own tests once more.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::process::Command;
use test_needs::{python, python_with_browser, skip_on_this_machine, skip_without};

/// Whether a test of `mod skips` passes under these variables, and what it said.
fn outcome(test: &str, variables: &[(&str, &str)]) -> (bool, String) {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--ignored", "--exact", &format!("skips::{test}")]).env_remove("STEPVALVE_CI");
    let output = command.envs(variables.iter().copied()).output().unwrap();
    let said =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("running 1 test"), "{said}");
    (output.status.success(), said)
}

/// A test, the variables of its process, whether it passes, and what it says.
type Case = (&'static str, &'static [(&'static str, &'static str)], bool, &'static str);

const CASES: [Case; 9] = [
    ("without_a_tool", &[], true, "not installed: a-tool"),
    ("without_a_tool", &[("STEPVALVE_CI", "0")], true, "not installed: a-tool"),
    ("without_a_tool", &[("STEPVALVE_CI", "1")], false, "not installed: a-tool"),
    ("on_this_machine", &[], true, "SKIPPED skips::on_this_machine: this kernel has no knob"),
    ("on_this_machine", &[("STEPVALVE_CI", "1")], true, "this kernel has no knob"),
    (
        "without_python",
        &[("STEPVALVE_PYTHON", "/nowhere")],
        true,
        "SKIPPED skips::without_python: not installed",
    ),
    ("without_python", &[("STEPVALVE_PYTHON", "/nowhere"), ("STEPVALVE_CI", "1")], false, "/nowhere"),
    ("without_a_browser", &[("CHROMEDRIVER", "/nowhere")], true, "/nowhere (CHROMEDRIVER)"),
    ("without_a_browser", &[("CHROMIUM", "/nowhere"), ("STEPVALVE_CI", "1")], false, "/nowhere (CHROMIUM)"),
];

#[test]
fn a_skipped_test_fails_in_ci_unless_the_machine_cannot_run_it() {
    for (test, variables, passes, says) in CASES {
        let (passed, said) = outcome(test, variables);
        assert_eq!(passed, passes, "{test} {variables:?}: {said}");
        assert!(said.contains(says), "{test} {variables:?}: {said}");
    }
}

/// Ignored: only the test above runs these, each in a process of its own.
mod skips {
    use super::*;

    #[test]
    #[ignore = "run by the test of the rule"]
    fn without_a_tool() {
        skip_without("a-tool");
    }

    #[test]
    #[ignore = "run by the test of the rule"]
    fn on_this_machine() {
        skip_on_this_machine("this kernel has no knob");
    }

    #[test]
    #[ignore = "run by the test of the rule"]
    fn without_python() {
        assert!(python(&["sys"]).is_none());
    }

    #[test]
    #[ignore = "run by the test of the rule"]
    fn without_a_browser() {
        assert!(python_with_browser().is_none());
    }
}

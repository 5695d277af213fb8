//! A short version of the fault campaigns: everything that docs/safety.md tells of, some hundred times, without a single
//! violation. The seed is printed with every finding.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use serde_json::Value;
use stepvalve_tests::{TestPlace, despite_stalls, program};

/// Runs a bench to its end; its JSON.
fn bench(place: &TestPlace, name: &str, seed: &str) -> Value {
    let out = place.path("results");
    let mut command = place.command("bench");
    command.args([name, "--quick", "--seed", seed, "--out"]).arg(&out);
    let output = command.output().unwrap();
    let (said, complaints) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    println!("{said}\n{complaints}");
    assert!(output.status.success(), "{complaints}");
    serde_json::from_slice(&std::fs::read(out.join(format!("{name}.json"))).unwrap()).unwrap()
}

fn trials(results: &Value) -> u64 {
    let totals = results["tables"].as_array().unwrap().iter().map(|table| {
        let rows = table["rows"].as_array().unwrap();
        rows.last().unwrap()[1].as_str().unwrap().parse::<u64>().unwrap()
    });
    totals.sum()
}

#[test]
fn faults_without_a_clock() {
    let place = TestPlace::new();
    let results = bench(&place, "safety", "11");
    assert_eq!(results["data"]["violations"], 0, "{}", results["data"]["found"]);
    assert!(trials(&results) > 3000, "{}", trials(&results));
}

#[test]
fn faults_in_real_time() {
    despite_stalls(|place| {
        let results = bench(place, "safety-live", "12");
        assert_eq!(results["data"]["violations"], 0, "{}", results["data"]["found"]);
        assert!(trials(&results) >= 20, "{}", trials(&results));
    });
}

/// Differences of it are beyond what a message may carry: a partner that refuses the status must not wait for it for ever.
#[test]
fn a_reading_that_is_wild_but_allowed_holds_nobody_up() {
    let place = TestPlace::new();
    let scenario = place.shortened("sine-1hz.toml", 0.3, &[]);
    let wild = "field feedback name=angle_rad value=0xc1f77825f0000000 count=1 at=193";
    let mut command = place.within(std::process::Command::new("timeout"));
    command.args(["60"]).arg(program("stepvalve")).args(["simulate", "--mode", "lockstep"]);
    command.args(["--allow-injection", "--inject", wild, "--out"]).arg(place.path("out")).arg(&scenario);
    let ended = command.output().unwrap();
    assert_eq!(ended.status.code(), Some(3), "{}", String::from_utf8_lossy(&ended.stderr));
}

#[test]
fn a_drive_that_stops_by_itself_is_a_fault_of_the_run() {
    let place = TestPlace::new();
    let scenario = place.shortened("sine-1hz.toml", 1.0, &[]);
    for (mode, fault) in [
        ("in-process", "silence step-controller at=400"),
        ("lockstep", "silence step-controller at=400"),
        ("realtime", "silence step-controller at=400"),
        ("in-process", "drop step-command count=200 at=400"),
    ] {
        let out = place.path(&format!("{mode}-{}", fault.len()));
        let mut command = place.within(std::process::Command::new("timeout"));
        command.args(["60"]).arg(program("stepvalve")).args([
            "simulate",
            "--mode",
            mode,
            "--allow-injection",
        ]);
        command.args(["--inject", fault, "--out"]).arg(&out).arg(&scenario);
        let ended = command.output().unwrap();
        let said = String::from_utf8_lossy(&ended.stdout);
        assert_eq!(ended.status.code(), Some(3), "{mode}, {fault}: {said}");
        assert!(said.contains("step command silent, found in cycle"), "{mode}, {fault}: {said}");
        assert!(!said.contains("fault of its own"), "{mode}, {fault}: {said}");
    }
}

#[test]
fn a_fault_needs_permission() {
    let place = TestPlace::new();
    assert!(program("stepvalve").exists());
    let scenario = place.shortened("sine-1hz.toml", 0.2, &[]);
    let file = scenario.to_str().unwrap();
    let out = place.path("out");
    let out = out.to_str().unwrap();
    for (arguments, says) in [
        (&["--mode", "lockstep", "--inject", "drop feedback at=5"][..], "--allow-injection"),
        (&["--mode", "lockstep", "--allow-injection", "--inject", "drop nothing"][..], "the message"),
        (
            &["--mode", "in-process", "--allow-injection", "--inject", "kill step-controller"][..],
            "in-process",
        ),
    ] {
        let all = [&["simulate", file, "--out", out][..], arguments].concat();
        let refused = place.stepvalve(&all).expect_code(2);
        assert!(refused.stderr.contains(says), "{}", refused.stderr);
    }
    place.stepvalve(&["inject", "drop", "nothing"]).expect_code(2);
}

//! Nothing in the cycle allocates, faults or calls the system but for its sleep.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::path::Path;
use std::process::Command;
use stepvalve_tests::{EARLY, Finished, despite_stalls, program};
use test_needs::{skip_on_this_machine, skip_without};

const LOOP: [&str; 3] = ["plant-simulator", "trajectory-generator", "step-controller"];

#[test]
fn no_page_fault_and_one_allocation_per_loan() {
    no_page_fault_and_no_more_than_a_loan_s_allocation(&[], 0);
}

/// What was borrowed before the first of the cycles that are looked at is sent in it: a message of each publisher at the most.
#[test]
fn waking_early_allocates_nothing_more() {
    no_page_fault_and_no_more_than_a_loan_s_allocation(&[EARLY], 3);
}

fn no_page_fault_and_no_more_than_a_loan_s_allocation(changes: &[(&str, &str)], borrowed: u64) {
    despite_stalls(|place| {
        let scenario = place.scenario("step-sequence.toml", changes);
        let summary = place.simulate(&scenario, "realtime", "out").expect_code(0).summary();
        for name in LOOP {
            let process = &summary["processes"][name];
            let count = |key: &str| process[key].as_u64().unwrap();
            assert!(count("steady_cycles") > 4000, "{process}");
            // iceoryx2 allocates once for each loan, and every message is a loan.
            let (allocations, published) = (count("steady_allocations"), count("steady_published"));
            assert!(
                (published - borrowed..=published).contains(&allocations),
                "{name}: {allocations} of {published}"
            );
            let locked = process["scheduling"]["memory_locked"].as_bool().unwrap();
            if locked {
                assert_eq!(process["steady_page_faults"]["minor"], 0, "{name}");
                assert_eq!(process["steady_page_faults"]["major"], 0, "{name}");
            } else {
                skip_on_this_machine(&format!("no right to lock memory, so {name} may have page faults"));
            }
        }
    });
}

/// A formula and a table in truth and belief, compensated: nothing allocates more than without.
#[test]
fn laws_of_users_allocate_nothing() {
    despite_stalls(|place| {
        let scenario = place.scenario_with_own_laws();
        let summary = place.simulate(&scenario, "realtime", "out").expect_code(0).summary();
        for name in LOOP {
            let process = &summary["processes"][name];
            assert!(process["steady_cycles"].as_u64().unwrap() > 4000, "{process}");
            assert_eq!(process["steady_allocations"], process["steady_published"], "{name}");
        }
    });
}

/// The program that a trace is of, and its system calls between the two calls of getrusage that enclose the cycles
/// after warm-up, without those of the last one.
fn steady_calls(trace: &Path) -> Option<(String, Vec<String>)> {
    let text = std::fs::read_to_string(trace).unwrap();
    let name = LOOP
        .iter()
        .find(|name| text.lines().any(|l| l.starts_with("execve(") && l.contains(&format!("/{name}\""))))?;
    let mut parts = text.split("getrusage(");
    let steady = parts.nth(1)?;
    parts.next()?;
    let calls = steady.lines().skip(1).filter_map(|line| line.split('(').next());
    let mut calls: Vec<_> = calls.map(str::to_owned).filter(|call| !call.is_empty()).collect();
    // In a process's last cycle a partner may have ended already, and what was mapped of it is let go.
    let last_sleep = calls.iter().rposition(|call| call == "clock_nanosleep")?;
    calls.truncate(last_sleep + 1);
    Some(((*name).to_owned(), calls))
}

#[test]
fn the_only_system_call_is_the_sleep() {
    if Command::new("strace").arg("--version").output().is_err() {
        skip_without("strace");
        return;
    }
    for changes in [&[][..], &[EARLY]] {
        the_only_system_call_of(changes);
    }
}

fn the_only_system_call_of(changes: &[(&str, &str)]) {
    despite_stalls(|place| {
        let scenario = place.shortened("sine-1hz.toml", 1.0, changes);
        let mut strace = place.within(Command::new("strace"));
        strace.args(["-f", "-ff", "-o"]).arg(place.path("trace")).arg(program("stepvalve"));
        strace.args(["simulate", "--json", "--out"]).arg(place.path("out")).arg(&scenario);
        Finished::from(strace.output().unwrap()).expect_code(0);
        let mut seen = Vec::new();
        for entry in std::fs::read_dir(place.path("")).unwrap().flatten() {
            if entry.file_name().to_string_lossy().starts_with("trace.")
                && let Some((name, calls)) = steady_calls(&entry.path())
            {
                let others: Vec<_> = calls.iter().filter(|call| *call != "clock_nanosleep").collect();
                assert!(others.is_empty(), "{name} calls {others:?}");
                assert!(calls.len() > 300, "{name}: {} sleeps", calls.len());
                seen.push(name);
            }
        }
        assert_eq!(seen.len(), LOOP.len(), "traces of {seen:?}");
    });
}

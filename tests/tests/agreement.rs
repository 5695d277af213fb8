//! Real time, lockstep and in process agree bit for bit; lockstep repeats itself; a replay gives what was recorded.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use std::collections::BTreeMap;
use stepvalve_tests::{EARLY, Payloads, TestPlace, despite_stalls, payloads};

const SHIPPED: [&str; 7] = [
    "step-sequence.toml",
    "sine-1hz.toml",
    "flow-steps.toml",
    "rotation-200khz.toml",
    "rotation-600khz.toml",
    "paper-initial.toml",
    "paper-revised.toml",
];

/// Compares all messages of cycles before `end`; says how many.
#[track_caller]
fn assert_same(what: &str, a: &Payloads, b: &Payloads, end: u64) -> usize {
    let topics = [
        ("Reference", &a.reference, &b.reference),
        ("StepCommand", &a.command, &b.command),
        ("Feedback", &a.feedback, &b.feedback),
    ];
    let mut compared = 0;
    for (topic, a, b) in topics {
        let before = |map: &BTreeMap<u64, Vec<u64>>| -> Vec<(u64, Vec<u64>)> {
            map.range(..end).map(|(cycle, words)| (*cycle, words.clone())).collect()
        };
        let (a, b) = (before(a), before(b));
        for (a, b) in a.iter().zip(&b) {
            assert_eq!(a, b, "{what}: {topic}");
        }
        assert_eq!(a.len(), b.len(), "{what}: {topic}");
        compared += a.len();
    }
    compared
}

#[test]
fn lockstep_and_in_process_agree_on_every_scenario() {
    let place = TestPlace::new();
    for shipped in SHIPPED {
        let scenario = place.scenario(shipped, &[]);
        let code = if shipped.starts_with("paper") { 3 } else { 0 };
        place.simulate(&scenario, "in-process", &format!("a-{shipped}")).expect_code(code);
        place.simulate(&scenario, "lockstep", &format!("b-{shipped}")).expect_code(code);
        let a = payloads(&place.path(&format!("a-{shipped}/run-0001.mcap")));
        let b = payloads(&place.path(&format!("b-{shipped}/run-0001.mcap")));
        let compared = assert_same(shipped, &a, &b, u64::MAX);
        assert!(compared > 9_000, "{shipped}: only {compared} messages");
    }
}

/// Formulas and tables travel to the processes, and a replay has them too.
#[test]
fn laws_of_users_agree_in_every_mode() {
    let place = TestPlace::new();
    let scenario = place.scenario_with_own_laws();
    let [a, b] = ["in-process", "lockstep"].map(|mode| {
        place.simulate(&scenario, mode, mode).expect_code(0);
        payloads(&place.path(mode).join("run-0001.mcap"))
    });
    assert!(assert_same("own laws", &a, &b, u64::MAX) > 9_000);
    let record = place.path("lockstep/run-0001.mcap");
    place.stepvalve(&["replay", record.to_str().unwrap()]).expect_code(0);
}

#[test]
fn two_lockstep_runs_give_the_same_run_file() {
    let place = TestPlace::new();
    let scenario = place.scenario("flow-steps.toml", &[]);
    let files = ["first", "second"].map(|out| {
        let summary = place.simulate(&scenario, "lockstep", out).expect_code(0).summary();
        assert_eq!(summary["declared_missing"], 0, "lockstep loses nothing");
        std::fs::read(place.path(out).join("run.h5")).unwrap()
    });
    assert!(
        files[0] == files[1],
        "two lockstep runs differ in {} and {} bytes",
        files[0].len(),
        files[1].len()
    );
}

#[test]
fn real_time_agrees_up_to_its_first_missed_cycle() {
    for changes in [&[][..], &[EARLY]] {
        real_time_agrees(changes);
    }
}

fn real_time_agrees(changes: &[(&str, &str)]) {
    despite_stalls(|place| {
        let scenario = place.shortened("step-sequence.toml", 0.4, changes);
        place.simulate(&scenario, "lockstep", "lockstep").expect_code(0);
        let lockstep = payloads(&place.path("lockstep/run-0001.mcap"));
        let mut best = 0;
        for attempt in 0..20 {
            let out = format!("realtime-{attempt}");
            // A machine that stalls for longer than the silence limit stops the valve: a fault, code 3, is no disagreement.
            let finished = place.simulate(&scenario, "realtime", &out);
            assert!(matches!(finished.code, Some(0 | 3)), "{}", finished.stderr);
            let realtime = payloads(&place.path(&out).join("run-0001.mcap"));
            assert_same("real time", &lockstep, &realtime, realtime.first_late_cycle);
            best = best.max(realtime.first_late_cycle);
            println!("attempt {attempt}: {} cycles until the first late one", realtime.first_late_cycle);
            if best >= 400 {
                break;
            }
        }
        assert!(best >= 100, "the best of 20 runs was late in cycle {best}");
    });
}

#[test]
fn a_replay_gives_the_recorded_commands_and_notices_any_other() {
    despite_stalls(|place| {
        let scenario = place.shortened("sine-1hz.toml", 1.0, &[]);
        for mode in ["lockstep", "realtime", "in-process"] {
            place.simulate(&scenario, mode, mode).expect_code(0);
            let record = place.path(mode).join("run-0001.mcap");
            let replayed = place.stepvalve(&["replay", record.to_str().unwrap()]).expect_code(0);
            assert!(replayed.stdout.contains("all bit for bit as recorded"), "{}", replayed.stdout);
        }
        // The same record under another belief: the first command that the belief changes is named.
        let record = place.path("lockstep/run-0001.mcap");
        let mut bytes = std::fs::read(&record).unwrap();
        let (old, new) = (b"coulomb_torque_nm = 1.5", b"coulomb_torque_nm = 1.4");
        let places: Vec<_> =
            (0..bytes.len() - old.len()).filter(|&at| &bytes[at..at + old.len()] == old).collect();
        assert!(!places.is_empty());
        for at in places {
            bytes[at..at + new.len()].copy_from_slice(new);
        }
        std::fs::write(place.path("other.mcap"), bytes).unwrap();
        let other = place.stepvalve(&["replay", place.path("other.mcap").to_str().unwrap()]).expect_code(1);
        assert!(
            other.stderr.contains("StepCommand") || other.stderr.contains("ControlStatus"),
            "{}",
            other.stderr
        );
    });
}

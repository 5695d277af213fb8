//! Killed processes, interruptions, a killed supervisor: the valve stops in time, and nothing is left.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use recording::{AnyMessage, GapOrigin, read_record};
use signals::{Feedback, Source, validity};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Child;
use std::thread::sleep;
use std::time::Duration;
use stepvalve_tests::{Finished, TestPlace, despite_stalls, despite_stalls_seen, stood_still_ns};

/// The shipped rotation, with the silence that a machine takes would end by the stalls of virtual machines: 20 cycles.
const SILENCE_CYCLES: u64 = 20;

const LOOP: [&str; 3] = ["plant-simulator", "trajectory-generator", "step-controller"];

fn rotation(place: &TestPlace) -> PathBuf {
    let silence = format!("silence_cycles = {SILENCE_CYCLES}");
    place.shortened("rotation-200khz.toml", 4.0, &[("silence_cycles", &silence)])
}

/// Something, once the record holds a second or so: the rotation begins after 0.3 s.
fn turning(place: &TestPlace) -> Option<()> {
    let record = std::fs::metadata(place.path("out/run-0001.mcap")).ok()?;
    (record.len() > 1_400_000).then_some(())
}

/// Starts the rotation, and kills one of its processes once it turns.
fn kill_one(place: &TestPlace, victim: &str) -> (Child, Pid) {
    let run = place.start_simulate(&rotation(place), "realtime", "out", &["--instance", "victim"]);
    let pid = place.wait_for(victim, || place.child_of(run.id(), victim));
    place.wait_for("the record", || turning(place));
    kill(pid, Signal::SIGKILL).unwrap();
    (run, pid)
}

fn feedbacks(place: &TestPlace) -> Vec<(u64, Feedback)> {
    let mut all = Vec::new();
    let segments: Vec<_> =
        (1..5).map(|n| place.path(&format!("out/run-{n:04}.mcap"))).filter(|p| p.exists()).collect();
    read_record(&segments, |message| {
        if let AnyMessage::Feedback(message) = message {
            all.push((message.header.cycle, message.body));
        }
    })
    .unwrap();
    all
}

#[test]
fn a_killed_recorder_is_replaced_and_the_gap_declared() {
    despite_stalls(|place| {
        let (run, _) = kill_one(place, "run-recorder");
        let finished = Finished::from(run.wait_with_output().unwrap()).expect_code(0);
        let summary = finished.summary();
        assert_eq!(summary["recorder_restarts"], 1, "{}", finished.stderr);
        // recorded + declared = published, by sequence numbers from the first message on.
        let published: u64 =
            LOOP.iter().map(|name| summary["processes"][name]["published"].as_u64().unwrap()).sum();
        let recorded = summary["recorded"].as_u64().unwrap();
        let missing = summary["declared_missing"].as_u64().unwrap();
        assert_eq!(recorded + missing, published);
        assert!(missing > 0, "a killed recorder loses something");
        let segments = [place.path("out/run-0001.mcap"), place.path("out/run-0002.mcap")];
        let report = read_record(&segments, |_| {}).unwrap();
        assert!(report.gaps.iter().all(|gap| gap.origin != GapOrigin::Undeclared), "{:?}", report.gaps);
        assert!(summary["fault"].is_null(), "{summary}");
        assert!(place.path("out/run.h5").exists());
        place.assert_nothing_left(&["victim"]);
    });
}

#[test]
fn a_closed_terminal_stops_nothing() {
    despite_stalls(|place| {
        let mut run = place.start_simulate(&rotation(place), "realtime", "out", &["--instance", "victim"]);
        let pid = place.wait_for("the recorder", || place.child_of(run.id(), "run-recorder"));
        place.wait_for("the record", || turning(place));
        // From here on nobody reads what the supervisor and its processes say; the recorder's death is something to say.
        drop(run.stderr.take());
        kill(pid, Signal::SIGKILL).unwrap();
        let finished = Finished::from(run.wait_with_output().unwrap()).expect_code(0);
        assert_eq!(finished.summary()["recorder_restarts"], 1);
        place.assert_nothing_left(&["victim"]);
    });
}

/// How often a loop process had overrun or skipped cycles, and when it said so.
#[derive(Clone, Copy)]
struct Late {
    cycle: u64,
    at_ns: u64,
    cycles: u64,
}

/// What each loop process said last before the recorder's death, and when its successor had been there for 100 cycles.
fn around_the_gap(place: &TestPlace) -> Vec<(Late, Late)> {
    let mut before = BTreeMap::new();
    each_lateness(place, "out/run-0001.mcap", |source, late| {
        before.insert(source, late);
    });
    let mut after = BTreeMap::<_, (u64, Late)>::new();
    each_lateness(place, "out/run-0002.mcap", |source, late| {
        let (first_cycle, last) = after.entry(source).or_insert((late.cycle, late));
        if late.cycle <= *first_cycle + 100 {
            *last = late;
        }
    });
    before.into_iter().map(|(source, before)| (before, after[&source].1)).collect()
}

fn each_lateness(place: &TestPlace, segment: &str, mut each: impl FnMut(Source, Late)) {
    read_record(&[place.path(segment)], |message| {
        if let AnyMessage::LoopTiming(source, message) = message {
            let (header, body) = (&message.header, &message.body);
            let cycles = body.overruns + body.skipped_cycles;
            each(*source, Late { cycle: header.cycle, at_ns: header.monotonic_ns, cycles });
        }
    })
    .unwrap();
}

/// The loop's core in the shipped scenarios, and its period.
const LOOP_CORE: usize = 1;
const PERIOD_NS: u64 = 1_000_000;

/// A core that stands still takes the cycles that begin meanwhile, and the one that is being worked on.
#[test]
fn the_loop_misses_no_cycle_for_a_killed_recorder() {
    despite_stalls_seen(|place, stalls| {
        let (run, _) = kill_one(place, "run-recorder");
        let _ = Finished::from(run.wait_with_output().unwrap());
        let gap = around_the_gap(place);
        assert_eq!(gap.len(), LOOP.len());
        for (before, after) in gap {
            let late = after.cycles - before.cycles;
            let stood_ns = stood_still_ns(stalls, LOOP_CORE, before.at_ns, after.at_ns);
            let for_stalls: u64 = stood_ns.iter().map(|ns| ns.div_ceil(PERIOD_NS) + 1).sum();
            assert!(
                late <= for_stalls,
                "{late} cycles late around the recorder's death; stalls, ns: {stood_ns:?}"
            );
        }
    });
}

#[test]
fn a_killed_loop_process_stops_the_valve_in_time() {
    for victim in ["step-controller", "trajectory-generator"] {
        despite_stalls(|place| {
            let (run, _) = kill_one(place, victim);
            let finished = Finished::from(run.wait_with_output().unwrap()).expect_code(1);
            assert!(finished.stderr.contains(&format!("{victim} died")), "{}", finished.stderr);
            let all = feedbacks(place);
            let (stopped_cycle, last) = *all.last().unwrap();
            assert!(
                last.validity & validity::STANDSTILL != 0,
                "{victim}: the valve still turns in cycle {stopped_cycle}"
            );
            if victim == "step-controller" {
                check_ramp(&all);
            }
            place.assert_nothing_left(&["victim"]);
        });
    }
}

/// From the last command on: at most `SILENCE_CYCLES` at the last rate, then the ramp from 200 kHz.
fn check_ramp(all: &[(u64, Feedback)]) {
    let last_command = all.iter().map(|(_, feedback)| feedback.command_cycle).max().unwrap();
    // Without pulses: that the rotor has swung out too is STANDSTILL, some cycles later.
    let still = all.iter().find(|(cycle, feedback)| *cycle > last_command && feedback.pulse_rate_hz == 0.0);
    let (stopped_cycle, feedback) = still.expect("it stops");
    // The scenario's quick stop takes 10 MHz/s: 20 ms from 200 kHz.
    let bound = SILENCE_CYCLES + 20 + 3;
    assert!(
        *stopped_cycle <= last_command + bound,
        "stopped {} cycles after the last command",
        stopped_cycle - last_command
    );
    assert!(feedback.validity & validity::STOPPED_ITSELF != 0, "the drive says that it stopped by itself");
    let rates: Vec<f64> =
        all.iter().filter(|(cycle, _)| *cycle > last_command).map(|(_, f)| f.pulse_rate_hz).collect();
    for pair in rates.windows(2) {
        let change = (pair[1] - pair[0]).abs();
        // A stall of the simulator hides cycles: then several changes come at once.
        assert!(change <= 10e6 * 1e-3 * 30.0, "the rate jumps by {change} Hz");
    }
}

#[test]
fn a_killed_plant_ends_the_run() {
    despite_stalls(|place| {
        let (run, _) = kill_one(place, "plant-simulator");
        let finished = Finished::from(run.wait_with_output().unwrap()).expect_code(1);
        assert!(finished.stderr.contains("plant-simulator died"), "{}", finished.stderr);
        place.assert_nothing_left(&["victim"]);
    });
}

#[test]
fn a_killed_partner_in_lockstep_ends_the_run() {
    let place = TestPlace::new();
    let scenario = place.scenario("sine-1hz.toml", &[("duration", "duration = \"2000s\"")]);
    for victim in ["step-controller", "plant-simulator", "trajectory-generator"] {
        let run = place.start_simulate(&scenario, "lockstep", victim, &["--instance", "victim"]);
        let pid = place.wait_for(victim, || place.child_of(run.id(), victim));
        let record = place.path(victim).join("run-0001.mcap");
        place.wait_for("the record", || std::fs::metadata(&record).ok().filter(|m| m.len() > 400_000));
        kill(pid, Signal::SIGKILL).unwrap();
        let finished = Finished::from(run.wait_with_output().unwrap()).expect_code(1);
        assert!(finished.stderr.contains(&format!("{victim} died")), "{}", finished.stderr);
        place.assert_nothing_left(&["victim"]);
    }
}

#[test]
fn an_interruption_stops_the_valve_first() {
    for signal in [Signal::SIGINT, Signal::SIGTERM] {
        despite_stalls(|place| {
            let run = place.start_simulate(&rotation(place), "realtime", "out", &["--instance", "victim"]);
            place.wait_for("the record", || turning(place));
            kill(Pid::from_raw(run.id().cast_signed()), signal).unwrap();
            let finished = Finished::from(run.wait_with_output().unwrap()).expect_code(130);
            assert!(finished.summary()["fault"].is_null(), "{}", finished.stdout);
            assert_told_as_interrupted(place, "out", &finished);
            let all = feedbacks(place);
            let turned = all.iter().any(|(_, feedback)| feedback.pulse_rate_hz > 100e3);
            let (_, last) = all.last().unwrap();
            assert!(turned && last.validity & validity::STANDSTILL != 0);
            assert!(
                last.validity & validity::STOPPED_ITSELF == 0,
                "the controller stopped it, not the guard"
            );
            place.assert_nothing_left(&["victim"]);
        });
    }
}

#[test]
fn an_interruption_without_a_clock_is_told() {
    let place = TestPlace::new();
    let scenario = place.scenario("sine-1hz.toml", &[("duration", "duration = \"2000s\"")]);
    for mode in ["lockstep", "in-process"] {
        let run = place.start_simulate(&scenario, mode, mode, &[]);
        let record = place.path(mode).join("run-0001.mcap");
        place.wait_for("the record", || std::fs::metadata(&record).ok().filter(|m| m.len() > 400_000));
        kill(Pid::from_raw(run.id().cast_signed()), Signal::SIGINT).unwrap();
        let finished = Finished::from(run.wait_with_output().unwrap()).expect_code(130);
        assert_told_as_interrupted(&place, mode, &finished);
    }
}

/// In the summary, and on the page.
fn assert_told_as_interrupted(place: &TestPlace, out: &str, finished: &Finished) {
    assert_eq!(finished.summary()["interrupted"], true, "{}", finished.stdout);
    let page = std::fs::read_to_string(place.path(out).join("run.html")).unwrap();
    assert!(page.contains("Interrupted before its end.") && page.contains("interrupted before the scenario"));
}

#[test]
fn what_a_killed_supervisor_left_is_cleaned_up_by_the_next_start() {
    despite_stalls(|place| {
        let mut run = place.start_simulate(&rotation(place), "realtime", "out", &["--instance", "victim"]);
        let plant = place.wait_for("the plant", || place.child_of(run.id(), "plant-simulator"));
        let recorder = place.wait_for("the recorder", || place.child_of(run.id(), "run-recorder"));
        place.wait_for("the record", || turning(place));
        run.kill().unwrap();
        run.wait().unwrap();
        assert!(!place.shared_memory_of("victim").is_empty(), "a kill leaves shared memory");
        for pid in [plant, recorder] {
            place.wait_for("the children's end", || kill(pid, None).is_err().then_some(()));
        }
        let all = feedbacks(place);
        let (_, last) = all.last().unwrap();
        assert!(last.validity & validity::STANDSTILL != 0, "the plant stopped the valve before it ended");
        // Another name cleans up too; its own run is untouched by that.
        let scenario = place.shortened("sine-1hz.toml", 0.2, &[]);
        let next = place.start_simulate(&scenario, "realtime", "next", &["--instance", "other"]);
        Finished::from(next.wait_with_output().unwrap()).expect_code(0);
        place.assert_nothing_left(&["victim", "other"]);
    });
}

#[test]
fn a_supervisor_killed_at_any_moment_leaves_no_process_for_long() {
    despite_stalls(|place| {
        let scenario = place.shortened("sine-1hz.toml", 1.0, &[]);
        for delay_ms in [2, 5, 10, 20, 40, 80, 160] {
            let out = format!("out-{delay_ms}");
            let mut run = place.start_simulate(&scenario, "realtime", &out, &["--instance", "victim"]);
            sleep(Duration::from_millis(delay_ms));
            run.kill().unwrap();
            run.wait().unwrap();
        }
        let last = place.start_simulate(&scenario, "realtime", "last", &["--instance", "victim"]);
        Finished::from(last.wait_with_output().unwrap()).expect_code(0);
        place.assert_nothing_left(&["victim"]);
    });
}

//! A replay recomputes what the controller said, whatever the record: of `run`, of a segment from the middle of a ring, of the
//! segments kept for a fault.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::Signal;
use std::path::{Path, PathBuf};
use std::time::Duration;
use stepvalve_tests::{TestPlace, despite_stalls, end_instance};

const NAME: &str = "replay";

/// Segments of a folder in their order.
fn segments(folder: &Path) -> Vec<PathBuf> {
    let mut found: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "mcap"))
        .collect();
    found.sort();
    found
}

/// What `replay` says of these segments, all of which it finds as recorded.
fn replay(place: &TestPlace, segments: &[PathBuf]) -> String {
    let mut arguments = vec!["replay"];
    arguments.extend(segments.iter().map(|path| path.to_str().unwrap()));
    let said = place.stepvalve(&arguments).expect_code(0).stdout;
    assert!(said.contains("all bit for bit as recorded"), "{said}");
    said
}

/// The number before a word of what was said; 0 where it was not said.
fn number_before(said: &str, word: &str) -> u64 {
    let words: Vec<&str> = said.split_whitespace().collect();
    let at = words.iter().position(|found| *found == word);
    at.map_or(0, |at| words[at - 1].parse().unwrap())
}

/// The number of commands recomputed from these segments.
fn replayed(place: &TestPlace, segments: &[PathBuf]) -> u64 {
    number_before(&replay(place, segments), "StepCommands")
}

/// An instance that is armed, moved, stopped by a fault, reset, and moved again.
fn eventful(place: &TestPlace, keep: &str, wait_s: u64) -> PathBuf {
    let out = place.path(&keep.replace('=', "-"));
    let scenario = place.scenario("rotation-200khz.toml", &[("silence_cycles", "silence_cycles = 500")]);
    let run = place.start_instance(NAME, &["--record", keep, "--allow-injection"], &scenario, &out);
    place.wait_for("the processes", || place.status().filter(|status| status["state"] == "disarmed"));
    let wait = || std::thread::sleep(Duration::from_secs(wait_s));
    place.stepvalve(&["arm"]).expect_code(0);
    place.stepvalve(&["set", "speed", "30deg/s"]).expect_code(0);
    wait();
    place.stepvalve(&["inject", "encoder-jump", "by_rad=1.5"]).expect_code(0);
    place.wait_for("the fault", || place.status().filter(|status| status["state"] == "fault"));
    wait();
    place.stepvalve(&["reset"]).expect_code(0);
    place.stepvalve(&["disarm"]).expect_code(0);
    end_instance(run, Signal::SIGTERM);
    out
}

#[test]
fn a_record_of_run_replays_whole() {
    despite_stalls(|place| {
        let out = eventful(place, "all", 1);
        let segments = segments(&out);
        assert!(replayed(place, &segments) > 2000, "{segments:?}");
    });
}

#[test]
fn every_segment_of_a_ring_replays_by_itself() {
    despite_stalls(|place| {
        let out = eventful(place, "ring=12MB", 6);
        let segments = segments(&out);
        let first = segments[0].file_name().unwrap().to_str().unwrap().to_owned();
        assert_ne!(first, "run-0001.mcap", "the ring removed nothing: {segments:?}");
        assert!(segments.iter().any(|path| path.to_str().unwrap().contains("-fault")), "{segments:?}");
        // The last one may be too short for a snapshot.
        for segment in &segments[..segments.len() - 1] {
            let said = replay(place, std::slice::from_ref(segment));
            assert!(number_before(&said, "StepCommands") > 900, "{said}");
            // Each begins with the controller's state: nothing lies before it.
            assert_eq!(number_before(&said, "more"), 0, "{said}");
        }
        assert!(replayed(place, &segments) > 2000);
    });
}

#[test]
fn what_is_missing_of_a_damaged_record_is_told() {
    let place = TestPlace::new();
    let scenario = place.shortened("sine-1hz.toml", 2.0, &[]);
    let out = place.path("run");
    let arguments = ["--mode", "lockstep", "--out", out.to_str().unwrap()];
    place.stepvalve(&[&["simulate", scenario.to_str().unwrap()][..], &arguments].concat()).expect_code(0);
    let segment = &segments(&out)[0];
    let whole = std::fs::read(segment).unwrap();
    let cut = place.path("cut.mcap");
    std::fs::write(&cut, &whole[..whole.len() / 2]).unwrap();
    let told = place.stepvalve(&["replay", cut.to_str().unwrap()]).expect_code(0).stderr;
    assert!(told.contains("cut.mcap") && told.contains("what is missing is not replayed"), "{told}");
    let told = place.stepvalve(&["replay", segment.to_str().unwrap()]).expect_code(0).stderr;
    assert!(!told.contains("missing"), "{told}");
}

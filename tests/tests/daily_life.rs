//! A day's life of an instance, in a minute: spoken to by several clients, recorded to the last message; disks that
//! fail; a ring that stays small; nothing left.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use recording::{AnyMessage, GapOrigin, Topic, read_record};
use serde_json::Value;
use std::collections::BTreeSet;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::thread::sleep;
use std::time::Duration;
use stepvalve_tests::{Finished, TestPlace, despite_stalls, end_instance};
use test_needs::skip_on_this_machine;

const LOOP: [&str; 3] = ["plant-simulator", "trajectory-generator", "step-controller"];

fn start(place: &TestPlace, scenario: &Path, record: &str, out: &Path) -> Child {
    place.start_instance("day", &["--json", "--record", record], scenario, out)
}

fn status(place: &TestPlace) -> Value {
    place.status().unwrap()
}

fn terminate(run: Child) -> Finished {
    end_instance(run, Signal::SIGTERM)
}

fn segments(out: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(out).unwrap().flatten().map(|entry| entry.path());
    let mut segments: Vec<_> = entries.filter(|path| path.extension().is_some_and(|e| e == "mcap")).collect();
    segments.sort();
    segments
}

/// The step sequence with a silence limit that a busy test machine's stalls don't reach, and room for following errors
/// while they last.
fn scenario(place: &TestPlace) -> PathBuf {
    place.scenario(
        "step-sequence.toml",
        &[
            ("silence_cycles", "silence_cycles = 500"),
            ("max_following_error", "max_following_error = \"30deg\""),
        ],
    )
}

/// Two clients at once, each with its own kinds of set-points.
fn set_points(place: &TestPlace) {
    let first = ["5deg", "10deg", "17deg", "22.5deg", "30deg", "0.1rad", "300mrad", "40deg", "2deg", "12deg"];
    let second = [
        ("opening", "0.5"),
        ("flow", "40L/min"),
        ("opening", "0.1"),
        ("flow", "20L/min"),
        ("opening", "0.9"),
    ];
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for angle in first {
                place.stepvalve(&["set", "angle", angle]).expect_code(0);
                sleep(Duration::from_millis(150));
            }
        });
        scope.spawn(|| {
            for (kind, value) in second.iter().chain(&second) {
                place.stepvalve(&["set", kind, value]).expect_code(0);
                sleep(Duration::from_millis(120));
            }
        });
        for _ in 0..10 {
            assert_eq!(status(place)["state"], "running");
            sleep(Duration::from_millis(100));
        }
    });
}

#[test]
fn a_day() {
    despite_stalls(|place| {
        let out = place.path("out");
        let run = start(place, &scenario(place), "all", &out);
        assert_eq!(status(place)["state"], "disarmed", "nothing arms by itself");
        let early = place.stepvalve(&["set", "angle", "5deg"]).expect_code(1);
        assert!(early.stderr.contains("refused: not running"), "{}", early.stderr);

        let armed = place.stepvalve(&["arm", "--instance", "day"]).expect_code(0);
        assert!(armed.stdout.starts_with("armed; the windings were without current"), "{}", armed.stdout);
        set_points(place);
        let refused = place.stepvalve(&["set", "angle", "400deg"]).expect_code(1);
        assert!(refused.stderr.contains("angle outside the limits"), "{}", refused.stderr);
        place.stepvalve(&["set", "angle", "17parsec"]).expect_code(2);
        // Clients that talk nonsense, or die in the middle of a word.
        for words in ["nonsense\n", "{\"request\":\"ar"] {
            let mut socket = UnixStream::connect(place.path("runtime/stepvalve/day/control.sock")).unwrap();
            std::io::Write::write_all(&mut socket, words.as_bytes()).unwrap();
        }
        place.stepvalve(&["mark", "the shift changes"]).expect_code(0);
        place.stepvalve(&["save-timing"]).expect_code(0);
        change_parameters(place);
        place.stepvalve(&["set", "angle", "17deg"]).expect_code(0);
        // `moving` is the reference's. Where the loops of the other tests hold the core back, the spool comes a little later.
        place.wait_for("standstill at 17°", || {
            let status = status(place);
            let angle_rad = status["angle_rad"].as_f64().unwrap();
            (status["moving"] == false && (angle_rad.to_degrees() - 17.0).abs() < 0.1).then_some(())
        });

        place.stepvalve(&["disarm"]).expect_code(0);
        assert_eq!(status(place)["state"], "disarmed");
        place.stepvalve(&["reset"]).expect_code(1);
        place.stepvalve(&["arm"]).expect_code(0);
        let finished = terminate(run).expect_code(0);
        check_account(&finished, &out);
        place.assert_nothing_left(&["day"]);
    });
}

/// One that is taken, one that the controller refuses, one that nobody knows.
fn change_parameters(place: &TestPlace) {
    place.stepvalve(&["set", "parameter", "observer-limit", "1.5"]).expect_code(0);
    let refused = place.stepvalve(&["set", "parameter", "observer-limit", "-1"]).expect_code(1);
    assert!(refused.stderr.contains("observer-limit -1, expected a value from 0 to "), "{}", refused.stderr);
    let unknown = place.stepvalve(&["set", "parameter", "observer-limits", "1"]).expect_code(1);
    assert!(unknown.stderr.contains("expected one of compensation-level"), "{}", unknown.stderr);
}

/// Recorded + declared gaps = published, exactly; and the record holds what was said.
fn check_account(finished: &Finished, out: &Path) {
    let end = finished.summary();
    let of = |name: &str| end["processes"][name]["published"].as_u64().unwrap();
    let published: u64 = LOOP.iter().map(|name| of(name)).sum::<u64>() + end["published"].as_u64().unwrap();
    let (mut set_points, mut orders) = (0, 0);
    let mut seen = BTreeSet::new();
    let report = read_record(&segments(out), |message| {
        seen.extend(message.topic());
        match message {
            AnyMessage::SetPoint(_) => set_points += 1,
            AnyMessage::OperatorCommand(_) => orders += 1,
            _ => {}
        }
    })
    .unwrap();
    // A simulated valve has no bus, and the recorder does not record its own progress.
    let nobodys = [Topic::BusStatus, Topic::RecorderProgress];
    let unseen: Vec<_> =
        Topic::ALL.iter().filter(|topic| !nobodys.contains(topic) && !seen.contains(topic)).collect();
    assert!(unseen.is_empty(), "not recorded: {unseen:?}");
    assert_eq!(report.recorded() + report.missed(), published);
    assert!(report.gaps.iter().all(|gap| gap.origin != GapOrigin::Undeclared), "{:?}", report.gaps);
    // The early one, ten angles, ten of the other client, the one too far, the last.
    assert_eq!(set_points, 1 + 10 + 10 + 1 + 1);
    // Arm, two changes of parameters, disarm, reset, arm; and the disarm that SIGTERM brings.
    assert_eq!(orders, 7);
    assert!(report.notes.iter().any(|note| note.text == "the shift changes"), "{:?}", report.notes);
    let timing = std::fs::read_dir(out).unwrap().flatten();
    assert!(timing.into_iter().any(|entry| entry.file_name().to_string_lossy().starts_with("slow-cycle-")));
}

/// A small file system of its own, where this machine lets us mount one.
struct SmallDisk(PathBuf);

impl SmallDisk {
    fn mount(path: PathBuf) -> Option<Self> {
        std::fs::create_dir(&path).unwrap();
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", "size=3m", "stepvalve-test"])
            .arg(&path)
            .status();
        if mounted.is_ok_and(|status| status.success()) {
            return Some(Self(path));
        }
        skip_on_this_machine("no right to mount a tmpfs");
        None
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        Command::new("umount").arg("--lazy").arg(&self.0).status().unwrap();
    }
}

#[test]
fn the_loop_does_not_notice_a_full_disk() {
    despite_stalls(|place| {
        let Some(disk) = SmallDisk::mount(place.path("small")) else { return };
        let run = start(place, &scenario(place), "all", &disk.0);
        place.stepvalve(&["arm"]).expect_code(0);
        place.wait_for("the full disk", || (status(place)["recorder_healthy"] == false).then_some(()));
        place.stepvalve(&["set", "angle", "17deg"]).expect_code(0);
        let before = status(place);
        sleep(Duration::from_millis(500));
        let after = status(place);
        assert_eq!(after["state"], "running");
        assert_eq!(after["fault"], "none");
        let cycles = |status: &Value| status["processes"]["plant-simulator"]["cycle"].as_u64().unwrap();
        assert!(cycles(&after) > cycles(&before) + 400);
        // The valve was served, the record was not: that is told in the exit code.
        let finished = terminate(run).expect_code(1);
        assert!(finished.stderr.contains("the record is not whole"), "{}", finished.stderr);
        let error =
            finished.summary()["processes"]["run-recorder"]["recording_error"].as_str().unwrap().to_owned();
        assert!(error.contains("No space left"), "{error}");
        // Everything up to the full disk can be read.
        let report = read_record(&segments(&disk.0), |_| {}).unwrap();
        assert!(report.recorded() > 5000, "{}", report.recorded());
        place.assert_nothing_left(&["day"]);
    });
}

#[test]
fn the_loop_does_not_notice_a_folder_that_takes_no_files() {
    despite_stalls(|place| {
        let out = place.path("out");
        let run = start(place, &scenario(place), "all", &out);
        place.stepvalve(&["arm"]).expect_code(0);
        let closed = Command::new("chattr").arg("+i").arg(&out).status().is_ok_and(|status| status.success());
        if !closed {
            skip_on_this_machine("no right to make a folder immutable (chattr)");
            terminate(run);
            return;
        }
        kill(place.child_of(run.id(), "run-recorder").unwrap(), Signal::SIGKILL).unwrap();
        place.wait_for("a new recorder", || {
            let status = status(place);
            (status["recorder_restarts"] == 1 && status["recorder_healthy"] == false).then_some(())
        });
        place.stepvalve(&["set", "angle", "17deg"]).expect_code(0);
        sleep(Duration::from_millis(300));
        assert_eq!(status(place)["state"], "running");
        let finished = terminate(run);
        Command::new("chattr").arg("-i").arg(&out).status().unwrap();
        finished.expect_code(1);
        place.assert_nothing_left(&["day"]);
    });
}

#[test]
fn a_ring_stays_within_its_size_and_keeps_what_led_to_a_fault() {
    despite_stalls(|place| {
        let out = place.path("out");
        let run = start(place, &scenario(place), "ring=10MB", &out);
        place.stepvalve(&["arm"]).expect_code(0);
        sleep(Duration::from_secs(1));
        // A trajectory that dies stops the valve with a fault, and the processes start again, disarmed.
        kill(place.child_of(run.id(), "trajectory-generator").unwrap(), Signal::SIGKILL).unwrap();
        place.wait_for("the next generation", || {
            let status = place.stepvalve(&["status", "--json"]);
            let status: Value = serde_json::from_str(&status.stdout).ok()?;
            (status["generation"] == 2).then_some(())
        });
        assert_eq!(status(place)["state"], "disarmed", "nothing arms by itself");
        sleep(Duration::from_secs(12));
        terminate(run).expect_code(0);
        let names: Vec<_> =
            segments(&out).iter().map(|p| p.file_name().unwrap().to_string_lossy().into_owned()).collect();
        let size = |fault: bool| -> u64 {
            let of =
                segments(&out).into_iter().filter(|path| path.to_string_lossy().contains("-fault") == fault);
            of.map(|path| std::fs::metadata(path).unwrap().len()).sum()
        };
        assert!(size(false) <= 12_500_000, "{} bytes in {names:?}", size(false));
        assert!(size(true) > 0, "nothing is kept of the fault: {names:?}");
        assert!(!out.join("run-0001.mcap").exists(), "the oldest segment is gone: {names:?}");
        place.assert_nothing_left(&["day"]);
    });
}

#[test]
fn a_process_that_says_nothing_is_named() {
    despite_stalls(|place| {
        let scenario = scenario(place);
        let run = start(place, &scenario, "all", &place.path("out"));
        for (victim, others) in
            [("run-recorder", "trajectory-generator"), ("trajectory-generator", "run-recorder")]
        {
            let pid = place.wait_for(victim, || place.child_of(run.id(), victim));
            kill(pid, Signal::SIGSTOP).unwrap();
            let silent = place.wait_for("the silence to be noticed", || silent(place));
            kill(pid, Signal::SIGCONT).unwrap();
            assert!(silent.contains(victim) && !silent.contains(others), "{silent}");
            place.wait_for("it to be heard again", || silent_none(place));
        }
        // Without a reference for so long the controller has stopped the valve, or nobody had armed it: either is an end.
        let ended = terminate(run);
        assert!(matches!(ended.code, Some(0 | 3)), "{:?}: {}", ended.code, ended.stderr);
        place.assert_nothing_left(&["day"]);
    });
}

/// The line of `stepvalve status` that names who is silent, where there is one.
fn silent(place: &TestPlace) -> Option<String> {
    let said = place.stepvalve(&["status"]).expect_code(0).stdout;
    said.lines().find(|line| line.starts_with("SILENT")).map(str::to_owned)
}

fn silent_none(place: &TestPlace) -> Option<()> {
    silent(place).is_none().then_some(())
}

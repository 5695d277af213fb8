//! Tried as an attacker, or a clumsy user, would: files in the wrong places, names that lead elsewhere, clients that say
//! nothing, values beyond all limits, folders removed under a live instance.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::fcntl::{FcntlArg, fcntl};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::os::unix::fs::{PermissionsExt, chown, symlink};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use stepvalve_tests::{Finished, TestPlace, end_instance, program};
use test_needs::skip_on_this_machine;

const NAME: &str = "victim";

/// A scenario whose processes bear with a busy test machine.
fn scenario(place: &TestPlace) -> PathBuf {
    place.scenario("step-sequence.toml", &[("silence_cycles", "silence_cycles = 500")])
}

fn spawn(place: &TestPlace, out: &str) -> Child {
    place.spawn_instance(NAME, &[], &scenario(place), &place.path(out))
}

fn start(place: &TestPlace) -> Child {
    place.start_instance(NAME, &[], &scenario(place), &place.path("out"))
}

/// The test user is root here or not; root alone can make files of other users.
fn is_root() -> bool {
    nix::unistd::geteuid().is_root()
}

/// The user that others' files belong to.
const NOBODY: u32 = 65534;

#[test]
fn a_name_that_leads_elsewhere_is_refused_everywhere() {
    let place = TestPlace::new();
    let scenario = scenario(&place);
    let file = scenario.to_str().unwrap();
    let out = place.path("out");
    let out = out.to_str().unwrap();
    for command in [
        &["run", file, "--out", out][..],
        &["simulate", file, "--out", out],
        &["arm"],
        &["disarm"],
        &["reset"],
        &["status"],
        &["mark", "x"],
        &["save-timing"],
        &["set", "angle", "1deg"],
        &["inject", "silence", "step-controller"],
    ] {
        for name in ["../../evil", "", "a/b", "."] {
            let all = [command, &["--instance", name]].concat();
            let refused = place.stepvalve(&all).expect_code(2);
            assert!(refused.stderr.contains("32 letters"), "{all:?}: {}", refused.stderr);
        }
    }
    assert!(!place.path("runtime/evil").exists() && !place.path("out").exists());
}

#[test]
fn a_runtime_folder_that_is_not_ours_alone_is_refused() {
    let place = TestPlace::new();
    let base = place.path("runtime/stepvalve");
    let refused = |says: &str| {
        let finished = place.stepvalve(&["status"]);
        assert!(finished.code != Some(0) && finished.stderr.contains(says), "{says}: {}", finished.stderr);
        let run = Finished::from(spawn(&place, "out").wait_with_output().unwrap());
        assert!(run.code != Some(0) && run.stderr.contains(says), "{says}: {}", run.stderr);
    };
    std::fs::create_dir(&base).unwrap();
    std::fs::set_permissions(&base, PermissionsExt::from_mode(0o770)).unwrap();
    refused("open to other users (mode 770)");
    std::fs::remove_dir(&base).unwrap();
    std::fs::create_dir(place.path("elsewhere")).unwrap();
    symlink(place.path("elsewhere"), &base).unwrap();
    refused("is a link");
    std::fs::remove_file(&base).unwrap();
    if is_root() {
        std::fs::create_dir(&base).unwrap();
        std::fs::set_permissions(&base, PermissionsExt::from_mode(0o700)).unwrap();
        chown(&base, Some(NOBODY), None).unwrap();
        refused("belongs to user 65534");
    }
}

#[test]
fn a_start_that_fails_leaves_no_lock() {
    let place = TestPlace::new();
    let base = place.path("runtime/stepvalve");
    let folder = base.join(NAME);
    std::fs::create_dir(&base).unwrap();
    std::fs::set_permissions(&base, PermissionsExt::from_mode(0o700)).unwrap();
    std::fs::create_dir(place.path("elsewhere")).unwrap();
    symlink(place.path("elsewhere"), &folder).unwrap();
    let run = Finished::from(spawn(&place, "out").wait_with_output().unwrap());
    assert!(run.code != Some(0) && run.stderr.contains("is a link"), "{}", run.stderr);
    let lock = stepvalve_tests::shared_memory_prefix(&folder).replacen("stepvalve", "stepvalve-lock", 1);
    assert!(!Path::new("/dev/shm").join(&lock).exists(), "{lock}");
}

#[test]
fn files_of_other_users_keep_nothing_from_starting() {
    if !is_root() {
        skip_on_this_machine("only root can make files of other users");
        return;
    }
    let place = TestPlace::new();
    let folder = place.path("runtime/stepvalve").join(NAME);
    let prefix = stepvalve_tests::shared_memory_prefix(&folder);
    let theirs = [
        format!("/dev/shm/{prefix}1_in_the_way"),
        format!("/dev/shm/{}", prefix.replacen("stepvalve", "stepvalve-lock", 1)),
    ];
    for path in &theirs {
        std::fs::write(path, "").unwrap();
        chown(path, Some(NOBODY), None).unwrap();
    }
    let run = start(&place);
    end_instance(run, Signal::SIGTERM).expect_code(0);
    for path in &theirs {
        assert!(Path::new(path).exists(), "{path} is not ours to remove");
        std::fs::remove_file(path).unwrap();
    }
    place.assert_nothing_left(&[NAME]);
}

#[test]
fn doctor_spares_an_instance_whose_runtime_folder_is_elsewhere() {
    let place = TestPlace::new();
    let run = start(&place);
    let files = place.shared_memory_of(NAME);
    assert!(!files.is_empty());
    let mut command = place.command("stepvalve");
    command.env("XDG_RUNTIME_DIR", place.path("other")).args(["doctor", "--json", "--measure", "0s"]);
    let report = Finished::from(command.output().unwrap()).summary();
    let findings = report["findings"].as_array().unwrap();
    let leftovers = findings.iter().find(|finding| finding["id"] == "leftovers").unwrap().to_string();
    let prefix = stepvalve_tests::shared_memory_prefix(&place.path("runtime/stepvalve").join(NAME));
    assert!(!leftovers.contains(&prefix), "{leftovers}");
    end_instance(run, Signal::SIGTERM).expect_code(0);
}

#[test]
fn a_removed_runtime_folder_lets_no_second_supervisor_start() {
    let place = TestPlace::new();
    let run = start(&place);
    std::fs::remove_dir_all(place.path("runtime/stepvalve").join(NAME)).unwrap();
    let refused = |out: &str| {
        let second = Finished::from(spawn(&place, out).wait_with_output().unwrap()).expect_code(2);
        assert!(
            second.stderr.contains("running already, though its runtime folder was removed"),
            "{}",
            second.stderr
        );
    };
    refused("second");
    // What a refused start leaves tells nobody that the name is free, and the start of another name wipes nothing that lives.
    let memory = place.shared_memory_of(NAME);
    let other = place.start_instance("other", &[], &scenario(&place), &place.path("other"));
    assert_eq!(place.shared_memory_of(NAME), memory);
    refused("third");
    end_instance(other, Signal::SIGTERM);
    // An operator is told what ends it.
    let kill = format!("`kill {}` stops its valve", run.id());
    let disarmed = place.stepvalve(&["disarm", "--instance", NAME]).expect_code(2);
    assert!(disarmed.stderr.contains(&kill), "{}", disarmed.stderr);
    let listed = place.stepvalve(&["list"]).expect_code(0);
    assert!(listed.stdout.contains(&kill), "{}", listed.stdout);
    let text = place.stepvalve(&["list", "--json"]).expect_code(0).stdout;
    let all: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
    let ours = all.iter().find(|one| one["supervisor"] == run.id()).expect(&text);
    assert_eq!((&ours["state"], ours["folder"].as_str()), (&"folder-gone".into(), None), "{text}");
    // The first goes on, and can be ended.
    end_instance(run, Signal::SIGTERM);
    place.assert_nothing_left(&[NAME]);
}

/// A folder that somebody made again after it was removed has free locks; its instance lives all the same.
#[test]
fn a_folder_made_anew_is_swept_only_where_nobody_lives() {
    let place = TestPlace::new();
    let run = start(&place);
    let folder = place.path("runtime/stepvalve").join(NAME);
    std::fs::remove_dir_all(&folder).unwrap();
    std::fs::create_dir(&folder).unwrap();
    let memory = place.shared_memory_of(NAME);
    let other = place.start_instance("other", &[], &scenario(&place), &place.path("other"));
    assert_eq!(place.shared_memory_of(NAME), memory);
    end_instance(other, Signal::SIGTERM);
    end_instance(run, Signal::SIGTERM);
    place.assert_nothing_left(&[NAME]);
}

#[test]
fn a_hang_up_is_a_clean_stop_unless_it_is_ignored() {
    let place = TestPlace::new();
    let run = start(&place);
    place.stepvalve(&["arm"]).expect_code(0);
    end_instance(run, Signal::SIGHUP).expect_code(130);
    place.assert_nothing_left(&[NAME]);

    let mut nohup = Command::new("nohup");
    nohup.arg(program("stepvalve")).args(["run", "--instance", NAME, "--out"]);
    nohup.arg(place.path("out")).arg(scenario(&place));
    let run = place.within(nohup).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    place.wait_for("the instance", || place.status());
    kill(Pid::from_raw(run.id().cast_signed()), Signal::SIGHUP).unwrap();
    std::thread::sleep(Duration::from_millis(200));
    assert!(place.status().is_some(), "nohup: it goes on");
    end_instance(run, Signal::SIGTERM).expect_code(0);
}

#[test]
fn idle_clients_keep_nobody_out() {
    let place = TestPlace::new();
    let run = start(&place);
    place.arm_when_ready();
    place.stepvalve(&["disarm"]).expect_code(0);
    let socket = place.path("runtime/stepvalve").join(NAME).join("control.sock");
    let idle: Vec<_> = (0..32).map(|_| UnixStream::connect(&socket).unwrap()).collect();
    let begun = Instant::now();
    place.stepvalve(&["status"]).expect_code(0);
    place.stepvalve(&["arm"]).expect_code(0);
    place.stepvalve(&["disarm"]).expect_code(0);
    // The idle ones would be sent away after five seconds each.
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
    drop(idle);
    end_instance(run, Signal::SIGTERM).expect_code(0);
}

#[test]
fn refusals_give_the_limit() {
    let place = TestPlace::new();
    let run = start(&place);
    place.stepvalve(&["arm"]).expect_code(0);
    for (words, says) in [
        (&["set", "flow", "1e300L/min"][..], "at most"),
        (&["set", "speed", "1e300rpm"], "rpm ("),
        (&["set", "flow", "4000L/min"], "at most"),
        (&["set", "angle", "1e200rad"], "expected -"),
        (&["set", "angle", "400deg"], "expected"),
        (&["set", "opening", "1.5"], "expected 0 to 1"),
        (&["set", "parameter", "observer-bandwidth", "1e30"], "expected"),
        (&["set", "parameter", "observer-bandwidth", "1e6"], "expected a value from "),
        (&["set", "parameter", "compensation-level", "1.5"], "expected a whole number from 0 to 3"),
        (&["set", "flow", "10L/min", "--pressure-drop", "1e300Pa"], "expected"),
    ] {
        let refused = place.stepvalve(words).expect_code(1);
        assert!(refused.stderr.contains(says), "{words:?}: {}", refused.stderr);
        assert!(!refused.stderr.contains("does not answer"), "{words:?}: {}", refused.stderr);
    }
    end_instance(run, Signal::SIGTERM).expect_code(0);
}

#[test]
fn a_recorder_that_dies_again_and_again_is_given_up_and_the_loss_is_told() {
    let place = TestPlace::new();
    let run = start(&place);
    place.wait_for("the end of its successors", || {
        if let Some(recorder) = place.child_of(run.id(), "run-recorder") {
            let _ = kill(recorder, Signal::SIGKILL);
        }
        place.status()?["recorder_given_up"].as_bool().filter(|given_up| *given_up)
    });
    let told = place.stepvalve(&["status"]).expect_code(0).stdout;
    assert!(told.contains("NOTHING IS RECORDED ANY MORE"), "{told}");
    // The valve turns without.
    place.stepvalve(&["arm"]).expect_code(0);
    place.stepvalve(&["set", "angle", "5deg"]).expect_code(0);
    let ended = end_instance(run, Signal::SIGTERM).expect_code(1);
    assert!(ended.stderr.contains("the record is not whole"), "{}", ended.stderr);
    place.assert_nothing_left(&[NAME]);
}

/// A terminal that was paused takes no more lines once its pipe is full: neither the journal's nor the recorder's own.
#[test]
fn a_recorder_whose_complaints_nobody_reads_records_again() {
    let place = TestPlace::new();
    let run = place.start_instance(NAME, &["--allow-injection"], &scenario(&place), &place.path("out"));
    fcntl(run.stderr.as_ref().unwrap(), FcntlArg::F_SETPIPE_SZ(4096)).unwrap();
    for _ in 0..100 {
        place.stepvalve(&["set", "angle", "1deg"]).expect_code(1);
    }
    place.stepvalve(&["inject", "disk-full"]).expect_code(0);
    let healthy = || place.status()?["recorder_healthy"].as_bool();
    place.wait_for("the record's loss", || (!healthy()?).then_some(()));
    let noted = place.stepvalve(&["mark", "while full"]).expect_code(0).stdout;
    if healthy() == Some(false) {
        assert!(noted.contains("THE DISK DOES NOT TAKE THE RECORD"), "{noted}");
    }
    place.wait_for("the next segment", || healthy()?.then_some(()));
    end_instance(run, Signal::SIGTERM).expect_code(0);
    place.assert_nothing_left(&[NAME]);
}

/// `command` in a mount namespace of its own, with shared memory of this size.
fn in_shared_memory_of(place: &TestPlace, size: &str, command: &[&str]) -> Finished {
    let mount = format!("mount -t tmpfs -o size={size} tmpfs /dev/shm && exec \"$@\"");
    let mut unshare = Command::new("unshare");
    unshare.args(["-Urm", "sh", "-c", &mount, "sh"]).args(command);
    place.within(unshare).output().unwrap().into()
}

#[test]
fn shared_memory_that_is_too_small_is_told_by_name() {
    let place = TestPlace::new();
    let possible = in_shared_memory_of(&place, "1M", &["true"]);
    if possible.code != Some(0) {
        return skip_on_this_machine(&format!("no mount namespace: {}", possible.stderr.trim()));
    }
    let (program, scenario) = (program("stepvalve"), scenario(&place));
    let simulate = |size: &str| {
        let out = place.path(size);
        let paths = [program.as_path(), out.as_path(), scenario.as_path()].map(|path| path.to_str().unwrap());
        let command = [paths[0], "simulate", "--mode", "lockstep", "--out", paths[1], paths[2]];
        in_shared_memory_of(&place, size, &command)
    };
    let said = simulate("16M").expect_code(1).stderr;
    assert!(said.contains("/dev/shm has 16 MB") && said.contains("mount -o remount,size="), "{said}");
    // As much as it asks for is enough.
    let needed = said.split("at least ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    simulate(&format!("{needed}M")).expect_code(0);
}

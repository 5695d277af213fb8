//! What an operator sees of an instance: its journal, the list of instances, the view on the terminal, a status that is true.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use std::io::{Read, Write};
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::Duration;
use stepvalve_tests::{Finished, TestPlace, despite_stalls, end_instance, program};

fn start(place: &TestPlace, name: &str) -> Child {
    let scenario = place.scenario("step-sequence.toml", &[("silence_cycles", "silence_cycles = 100")]);
    place.start_instance(name, &["--record", "none"], &scenario, &place.path(name))
}

fn signal(place: &TestPlace, run: &Child, name: &str, signal: Signal) {
    let pid = place.wait_for(name, || place.child_of(run.id(), name));
    kill(pid, signal).unwrap();
}

/// The events' kinds and texts.
fn events(finished: &Finished) -> Vec<(String, String)> {
    let word = |entry: &Value, key: &str| entry[key].as_str().unwrap().to_owned();
    let lines = finished.stdout.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    lines.map(|entry| (word(&entry, "event"), word(&entry, "text"))).collect()
}

#[test]
fn the_journal_tells_what_happened_and_whose_order_it_was() {
    despite_stalls(tell);
}

fn tell(place: &TestPlace) {
    let run = start(place, "told");
    let refused = place.stepvalve(&["set", "angle", "17°"]).expect_code(1);
    assert!(refused.stderr.contains("first: stepvalve arm"), "{}", refused.stderr);
    place.stepvalve(&["arm"]).expect_code(0);
    place.stepvalve(&["set", "angle", "17.5°"]).expect_code(0);
    let refused = place.stepvalve(&["set", "angle", "0.5turn"]).expect_code(1);
    let wanted = "180.000° asked, expected -5.000° to 50.000°";
    assert!(refused.stderr.contains(wanted), "{}", refused.stderr);
    place.stepvalve(&["mark", "the shift changes"]).expect_code(0);
    place.wait_for("the end of the motion", || place.status().filter(|status| status["moving"] == false));
    signal(place, &run, "step-controller", Signal::SIGSTOP);
    let status =
        place.wait_for("the silence", || place.status().filter(|status| status["state"] == "silent"));
    assert_eq!(status["last_state"], "running");
    let text = place.stepvalve(&["status"]).expect_code(0).stdout;
    assert!(text.contains("UNKNOWN: the controller has said nothing for"), "{text}");
    assert!(!text.contains("running, ") && !text.contains(" moving to"), "{text}");
    signal(place, &run, "step-controller", Signal::SIGCONT);
    place.wait_for("the fault", || place.status().filter(|status| status["state"] == "fault"));
    let text = place.stepvalve(&["status"]).expect_code(0).stdout;
    assert!(
        text.contains("drive (step command silent), found in cycle") && text.contains("stalled"),
        "{text}"
    );
    place.stepvalve(&["reset"]).expect_code(0);
    let again = place.stepvalve(&["reset"]).expect_code(1);
    assert!(again.stderr.contains("without a fault: there is nothing to reset"), "{}", again.stderr);
    let running = events(&place.stepvalve(&["events", "--json"]).expect_code(0));
    let ended = end_instance(run, Signal::SIGTERM).expect_code(0);
    assert!(ended.stderr.contains("stepvalve arm --instance told"), "{}", ended.stderr);
    let folder = place.path("told");
    let told = events(&place.stepvalve(&["events", "--json", folder.to_str().unwrap()]).expect_code(0));
    assert_eq!(running, told[..running.len()], "the journal of a running instance is that of its record");
    let find = |kind: &str, text: &str| {
        let found = told.iter().position(|(k, t)| k == kind && t.contains(text));
        found.unwrap_or_else(|| panic!("no {kind} with \"{text}\" in {told:#?}"))
    };
    let order = [
        find("ready", "disarmed"),
        find("refused", "set: not running"),
        find("order", "armed"),
        find("order", "to 17.500°"),
        find("refused", "180.000° asked"),
        find("note", "the shift changes"),
        find("process", "step-controller is silent"),
        find("process", "step-controller is heard again"),
        find("order", "reset: disarmed"),
        find("end", "told to end"),
    ];
    assert!(order.is_sorted(), "{told:#?}");
    find("fault", "silent");
    let people = place.stepvalve(&["events", "--last", "3", folder.to_str().unwrap()]).expect_code(0).stdout;
    assert_eq!(people.lines().count(), 3);
    let all = place.stepvalve(&["events", folder.to_str().unwrap()]).expect_code(0).stdout;
    let armed = all.lines().find(|line| line.contains("  armed")).unwrap();
    assert!(armed.contains("[user ") && armed.contains("process "), "{armed}");
}

#[test]
fn a_dead_instance_stands_in_nobodys_way() {
    let place = TestPlace::new();
    let dead = start(&place, "dead");
    let alive = place.spawn_instance(
        "alive",
        &["--record", "none"],
        &place.scenario("step-sequence.toml", &[("silence_cycles", "silence_cycles = 100")]),
        &place.path("alive"),
    );
    place.wait_for("both", || (listed(&place).len() == 2).then_some(()));
    let several = place.stepvalve(&["status"]).expect_code(2);
    assert!(several.stderr.contains("several instances run"), "{}", several.stderr);
    let pids: Vec<Pid> = ["plant-simulator", "trajectory-generator", "step-controller", "run-recorder"]
        .iter()
        .filter_map(|name| place.child_of(dead.id(), name))
        .chain([Pid::from_raw(dead.id().cast_signed())])
        .collect();
    for pid in &pids {
        // The supervisor may have ended a process meanwhile.
        let _ = kill(*pid, Signal::SIGKILL);
    }
    let mut dead = dead;
    dead.wait().unwrap();
    place.wait_for("its death", || {
        listed(&place).into_iter().find(|(name, state)| name == "dead" && state == "dead").map(drop)
    });
    place.wait_for("the other", || {
        place.stepvalve(&["arm"]).expect_code(0).stdout.contains("armed").then_some(())
    });
    place.stepvalve(&["disarm"]).expect_code(0);
    let list = place.stepvalve(&["list"]).expect_code(0).stdout;
    assert!(list.contains("dead: left by a crash") && list.contains("disarmed"), "{list}");
    end_instance(alive, Signal::SIGTERM).expect_code(0);
}

/// Names and states of the instances of this place.
fn listed(place: &TestPlace) -> Vec<(String, String)> {
    let text = place.stepvalve(&["list", "--json"]).expect_code(0).stdout;
    let all: Vec<Value> = serde_json::from_str(&text).unwrap();
    let here = place.path("runtime").display().to_string();
    let ours =
        all.iter().filter(|one| one["folder"].as_str().is_some_and(|folder| folder.starts_with(&here)));
    let word = |one: &Value, key: &str| one[key].as_str().unwrap().to_owned();
    ours.map(|one| (word(one, "instance"), word(one, "state"))).collect()
}

#[test]
fn the_view_shows_the_valve_until_q() {
    if std::process::Command::new("script").arg("--version").output().is_err() {
        return test_needs::skip_without("script (bsdutils)");
    }
    let place = TestPlace::new();
    let run = start(&place, "seen");
    let nowhere = place.stepvalve(&["watch"]).expect_code(2);
    assert!(nowhere.stderr.contains("stepvalve status --watch"), "{}", nowhere.stderr);
    let mut command = place.within(std::process::Command::new("script"));
    let watch = format!("stty rows 30 cols 110; {} watch", program("stepvalve").display());
    command.args(["-qec", &watch, "/dev/null"]).stdin(Stdio::piped()).stdout(Stdio::piped());
    command.env("TERM", "xterm");
    let mut terminal = command.spawn().unwrap();
    sleep(Duration::from_secs(1));
    terminal.stdin.as_mut().unwrap().write_all(b"q").unwrap();
    let mut shown = String::new();
    terminal.stdout.take().unwrap().read_to_string(&mut shown).unwrap();
    assert!(terminal.wait().unwrap().success());
    for expected in ["seen", "disarmed", "step-controller", "following"] {
        assert!(shown.contains(expected), "{expected} is missing: {shown}");
    }
    end_instance(run, Signal::SIGTERM).expect_code(0);
}

#[test]
fn a_status_that_is_watched_is_a_line_a_second() {
    let place = TestPlace::new();
    let run = start(&place, "lines");
    let mut watch = place.command("stepvalve");
    let watch = watch.args(["status", "--watch", "--json"]).stdout(Stdio::piped()).spawn().unwrap();
    sleep(Duration::from_millis(1500));
    kill(Pid::from_raw(watch.id().cast_signed()), Signal::SIGINT).unwrap();
    let printed = Finished::from(watch.wait_with_output().unwrap()).expect_code(0).stdout;
    let states: Vec<_> =
        printed.lines().map(|line| serde_json::from_str::<Value>(line).unwrap()["state"].clone()).collect();
    assert!(!states.is_empty() && states.iter().all(|state| state == "disarmed"), "{states:?}");
    end_instance(run, Signal::SIGTERM).expect_code(0);
}

#[test]
fn new_files_are_right_and_overwrite_nothing() {
    let place = TestPlace::new();
    let new = |what: &str| {
        let mut command = place.command("stepvalve");
        let finished =
            Finished::from(command.args(["new", what]).current_dir(place.path("")).output().unwrap());
        finished.code
    };
    // The scenario's check reads the model.
    let places = [("drive", "drive.toml"), ("model", "model.toml"), ("scenario", "scenario.toml")];
    for (what, file) in places {
        assert_eq!(new(what), Some(0));
        let path = place.path(file);
        let checked = place.stepvalve(&["check", path.to_str().unwrap()]).expect_code(0);
        // A drive file says nothing of a valve.
        let told = checked.stdout.contains("still the template's");
        assert_eq!(told, what != "drive", "{what}: {}", checked.stdout);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("# ") && text.contains(&format!("stepvalve check {file}")), "{text}");
        assert_eq!(new(what), Some(2));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }
    std::fs::remove_file(place.path("model.toml")).unwrap();
    assert_eq!(new("torque-model"), Some(0));
    place.stepvalve(&["check", place.path("model.toml").to_str().unwrap()]).expect_code(0);
}

#[test]
fn shells_and_man_know_the_commands() {
    let place = TestPlace::new();
    for shell in ["bash", "zsh", "fish"] {
        let text = place.stepvalve(&["completions", shell]).expect_code(0).stdout;
        assert!(text.contains("diagnose") && text.contains("instance"), "{shell}");
    }
    let folder = place.path("man");
    place.stepvalve(&["man", "--out", folder.to_str().unwrap()]).expect_code(0);
    let page = std::fs::read_to_string(folder.join("stepvalve-run.1")).unwrap();
    assert!(page.contains(".TH") && page.contains("instance"), "{page}");
    let list = place.stepvalve(&["--help"]).expect_code(0).stdout;
    let headings: Vec<usize> =
        ["Simulate:", "Run a valve:", "Measured data:"].iter().filter_map(|of| list.find(of)).collect();
    assert!(headings.len() == 3 && headings.is_sorted(), "{list}");
    let help = place.stepvalve(&["help", "set"]).expect_code(0).stdout;
    assert!(help.contains("set-point"), "{help}");
}

//! Orders to an instance of which something is stopped or gone: what was refused has no effect later, and a disarm gets
//! through, or says within a second that it could not and what stops the valve instead.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::os::unix::net::UnixStream;
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use stepvalve_tests::{Finished, TestPlace, despite_stalls};

const NAME: &str = "ordered";

/// No answer of the product takes so long; one that waits for something that is stopped takes many times as long.
const HANGS: Duration = Duration::from_secs(4);

struct Instance<'a> {
    place: &'a TestPlace,
    run: Child,
}

impl<'a> Instance<'a> {
    fn start(place: &'a TestPlace) -> Self {
        let scenario = place.scenario("rotation-200khz.toml", &[("silence_cycles", "silence_cycles = 100")]);
        let run = place.start_instance(NAME, &["--record", "none"], &scenario, &place.path("out"));
        Self { place, run }
    }

    fn state(&self) -> String {
        self.place.wait_for("a status", || self.place.status())["state"].as_str().unwrap().to_owned()
    }

    fn pid(&self, name: &str) -> Pid {
        match name {
            "supervisor" => Pid::from_raw(self.run.id().cast_signed()),
            process => self.place.wait_for(process, || self.place.child_of(self.run.id(), process)),
        }
    }

    fn signal(&self, name: &str, signal: Signal) {
        kill(self.pid(name), signal).unwrap();
    }

    /// Armed and turning.
    fn turn(&self) {
        self.place.stepvalve(&["arm"]).expect_code(0);
        self.place.stepvalve(&["set", "speed", "60rpm"]).expect_code(0);
        self.place.wait_for("the rotation", || {
            self.place.status()?["pulse_rate_hz"].as_f64().filter(|rate| *rate > 100e3)
        });
    }

    /// Runs a command; how it ended, in a time that is no hanging.
    fn ask(&self, words: &[&str]) -> Finished {
        let begun = Instant::now();
        let finished = self.place.stepvalve(words);
        assert!(begun.elapsed() < HANGS, "{words:?} took {:?}: {}", begun.elapsed(), finished.stderr);
        finished
    }

    /// It stays as it is for a while in which an order that waits somewhere would have been carried out.
    fn never(&self, state: &str) {
        for _ in 0..30 {
            assert_ne!(self.state(), state);
            sleep(Duration::from_millis(10));
        }
    }

    fn end(self) {
        self.signal("supervisor", Signal::SIGTERM);
        let _ = self.run.wait_with_output().unwrap();
        self.place.assert_nothing_left(&[NAME]);
    }
}

#[test]
fn an_arm_that_was_refused_does_not_arm_later() {
    for stopped in ["step-controller", "supervisor", "plant-simulator", "trajectory-generator"] {
        let place = TestPlace::new();
        let instance = Instance::start(&place);
        instance.signal(stopped, Signal::SIGSTOP);
        // Long enough for the partners to notice.
        sleep(Duration::from_millis(300));
        let refused = instance.ask(&["arm"]).expect_code(1);
        assert!(!refused.stderr.is_empty(), "{stopped}");
        instance.signal(stopped, Signal::SIGCONT);
        instance.never("running");
        instance.end();
    }
}

#[test]
fn an_arm_waits_for_a_message_that_is_late() {
    despite_stalls(|place| {
        let instance = Instance::start(place);
        instance.signal("trajectory-generator", Signal::SIGSTOP);
        // What was sent before is read.
        sleep(Duration::from_millis(20));
        let arm = place.command("stepvalve").arg("arm").stdout(Stdio::null()).spawn().unwrap();
        sleep(Duration::from_millis(80));
        instance.signal("trajectory-generator", Signal::SIGCONT);
        assert!(arm.wait_with_output().unwrap().status.success());
        assert_eq!(instance.state(), "running");
        instance.end();
    });
}

#[test]
fn an_arm_whose_client_was_killed_does_not_arm_later() {
    let place = TestPlace::new();
    let instance = Instance::start(&place);
    instance.signal("supervisor", Signal::SIGSTOP);
    let mut client = place.command("stepvalve").arg("arm").stderr(Stdio::null()).spawn().unwrap();
    sleep(Duration::from_millis(200));
    client.kill().unwrap();
    client.wait().unwrap();
    instance.signal("supervisor", Signal::SIGCONT);
    instance.never("running");
    instance.end();
}

#[test]
fn a_set_point_that_was_refused_is_not_followed_later() {
    let place = TestPlace::new();
    let instance = Instance::start(&place);
    place.stepvalve(&["arm"]).expect_code(0);
    let trajectory = instance.pid("trajectory-generator");
    kill(trajectory, Signal::SIGSTOP).unwrap();
    instance.ask(&["set", "speed", "60rpm"]).expect_code(1);
    kill(trajectory, Signal::SIGCONT).unwrap();
    // The silence stopped the controller meanwhile; armed again, it finds no old wish.
    place.wait_for("the fault", || (instance.state() == "fault").then_some(()));
    place.stepvalve(&["reset"]).expect_code(0);
    place.stepvalve(&["arm"]).expect_code(0);
    sleep(Duration::from_millis(200));
    assert_eq!(place.status().unwrap()["moving"], false);
    instance.end();
}

#[test]
fn a_disarm_waits_behind_nothing() {
    let place = TestPlace::new();
    let instance = Instance::start(&place);
    let socket = place.path("runtime/stepvalve").join(NAME).join("control.sock");

    instance.turn();
    let idle: Vec<_> = (0..32).map(|_| UnixStream::connect(&socket).unwrap()).collect();
    instance.ask(&["disarm"]).expect_code(0);
    drop(idle);
    assert_eq!(instance.state(), "disarmed");

    // A supervisor that is stopped, with a queue of clients before its door.
    instance.turn();
    instance.signal("supervisor", Signal::SIGSTOP);
    let waiting: Vec<_> = (0..32).map(|_| UnixStream::connect(&socket).unwrap()).collect();
    let done = instance.ask(&["disarm"]).expect_code(0);
    assert!(done.stdout.contains("the valve stands"), "{}", done.stdout);
    drop(waiting);
    instance.signal("supervisor", Signal::SIGCONT);
    instance.never("running");
    assert_eq!(instance.state(), "disarmed");

    // A client that was killed in the middle, beside another order.
    instance.turn();
    let mut client = place.command("stepvalve").args(["set", "speed", "10rpm"]).spawn().unwrap();
    client.kill().unwrap();
    client.wait().unwrap();
    instance.ask(&["disarm"]).expect_code(0);
    assert_eq!(instance.state(), "disarmed");
    instance.end();
}

#[test]
fn of_a_valve_that_nothing_is_heard_of_nobody_says_that_it_stands() {
    let place = TestPlace::new();
    let instance = Instance::start(&place);
    instance.turn();
    instance.signal("plant-simulator", Signal::SIGSTOP);
    place.wait_for("the fault", || (instance.state() == "fault").then_some(()));
    for (order, says) in [("disarm", "whether it stands is not known"), ("reset", "not ready")] {
        let refused = instance.ask(&[order]).expect_code(1);
        assert!(refused.stderr.contains(says), "{order}: {}", refused.stderr);
        assert!(!refused.stdout.contains("stands"), "{order}: {}", refused.stdout);
    }
    assert_eq!(instance.state(), "fault");
    let events = place.stepvalve(&["events"]).expect_code(0).stdout;
    assert!(events.contains("whether the valve does is not known"), "{events}");
    assert!(!events.contains("the valve stands;"), "{events}");
    instance.signal("plant-simulator", Signal::SIGCONT);
    place.wait_for("a reset", || (place.stepvalve(&["reset"]).code == Some(0)).then_some(()));
    assert_eq!(instance.state(), "disarmed");
    instance.end();
}

#[test]
fn a_disarm_that_can_not_be_done_says_what_stops_the_valve_instead() {
    for stopped in [&["step-controller"][..], &["supervisor", "step-controller"]] {
        let place = TestPlace::new();
        let instance = Instance::start(&place);
        instance.turn();
        let pids: Vec<_> = stopped.iter().map(|name| instance.pid(name)).collect();
        pids.iter().for_each(|pid| kill(*pid, Signal::SIGSTOP).unwrap());
        let refused = instance.ask(&["disarm"]).expect_code(1);
        for says in ["within 1 s", "does not answer", "guard", "kill -KILL"] {
            assert!(refused.stderr.contains(says), "{stopped:?}: {}", refused.stderr);
        }
        pids.iter().for_each(|pid| kill(*pid, Signal::SIGCONT).unwrap());
        // The guard has stopped the valve, as it was told.
        place
            .wait_for("standstill", || place.status()?["pulse_rate_hz"].as_f64().filter(|rate| *rate == 0.0));
        instance.never("running");
        instance.end();
    }
}

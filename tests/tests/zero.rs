//! What an instance knows of the angle's zero: kept over a restart of its processes, found by `stepvalve home`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::{Signal, kill};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Child;
use stepvalve_tests::{TestPlace, end_instance};

const NAME: &str = "zero";

fn start(place: &TestPlace, scenario: &Path) -> Child {
    let run = place.start_instance(NAME, &["--record", "none"], scenario, &place.path("out"));
    generation(place, 1);
    run
}

/// Waits until the processes of this start run; the status then.
fn generation(place: &TestPlace, number: u64) -> Value {
    place.wait_for("the processes", || {
        place.status().filter(|status| {
            let cycle = status["processes"]["step-controller"]["cycle"].as_u64();
            status["generation"].as_u64() == Some(number) && cycle > Some(100)
        })
    })
}

fn end(place: &TestPlace, run: Child) {
    end_instance(run, Signal::SIGTERM);
    place.assert_nothing_left(&[NAME]);
}

fn degrees(status: &Value) -> f64 {
    status["angle_rad"].as_f64().unwrap().to_degrees()
}

/// The step sequence with more in it, and room for the stalls of a busy test machine.
fn scenario(place: &TestPlace, more: &str) -> PathBuf {
    let path = place.scenario(
        "step-sequence.toml",
        &[
            ("silence_cycles", "silence_cycles = 500"),
            ("max_following_error", "max_following_error = \"30deg\""),
        ],
    );
    let text = std::fs::read_to_string(&path).unwrap();
    place.write("with-more.toml", &format!("{text}\n{more}"))
}

#[test]
fn a_restart_of_the_processes_leaves_the_valve_where_it_is() {
    let place = TestPlace::new();
    let run = start(&place, &scenario(&place, ""));
    place.stepvalve(&["arm"]).expect_code(0);
    place.stepvalve(&["set", "angle", "30deg"]).expect_code(0);
    let before = place.wait_for("the angle", || {
        place.status().filter(|status| status["moving"] == false && degrees(status) > 29.0)
    });
    // The drive held the rotor when the controller died; the plant's process dies while the valve is disarmed, without current.
    for (victim, next, homed) in [("step-controller", 2, true), ("plant-simulator", 3, false)] {
        let pid = place.child_of(run.id(), victim).unwrap();
        kill(pid, Signal::SIGKILL).unwrap();
        let after = generation(&place, next);
        let moved = degrees(&after) - degrees(&before);
        // Half a tooth pitch, where the current went and came.
        assert!(moved.abs() < 3.7, "{victim}: {} was {}", degrees(&after), degrees(&before));
        assert_eq!(
            (&after["state"], after["homed"].as_bool()),
            (&json!("disarmed"), Some(homed)),
            "{victim}"
        );
    }
    end(&place, run);
}

#[test]
fn a_valve_that_is_not_homed_is_homed_by_a_switch() {
    let place = TestPlace::new();
    let homing = "[homing]\nbegins_homed = false\nmethod = \"switch\"\nspeed = \"-20deg/s\"\nangle = \"-5deg\"\n\
                  longest = \"90deg\"\n[homing.simulated]\nswitch = \"-5deg\"\n";
    let run = start(&place, &scenario(&place, homing));
    assert_eq!(place.status().unwrap()["homed"], false);
    place.stepvalve(&["arm"]).expect_code(0);
    let refused = place.stepvalve(&["set", "angle", "5deg"]).expect_code(1);
    assert!(refused.stderr.contains("not homed"), "{}", refused.stderr);
    place.stepvalve(&["disarm"]).expect_code(0);
    let homed = place.stepvalve(&["home"]).expect_code(0);
    assert!(homed.stdout.contains("homed at"), "{}", homed.stdout);
    let after = place.status().unwrap();
    assert_eq!((after["homed"].as_bool(), after["homing"].as_str()), (Some(true), Some("done")), "{after}");
    place.stepvalve(&["disarm"]);
    place.stepvalve(&["arm"]).expect_code(0);
    place.stepvalve(&["set", "angle", "5deg"]).expect_code(0);
    end(&place, run);
}

#[test]
fn a_valve_that_can_not_be_homed_says_so() {
    let place = TestPlace::new();
    let run = start(&place, &scenario(&place, ""));
    let refused = place.stepvalve(&["home"]).expect_code(1);
    assert!(refused.stderr.contains("no way of homing"), "{}", refused.stderr);
    assert!(refused.stderr.contains("no section [homing]"), "{}", refused.stderr);
    end(&place, run);
}

#[test]
fn lost_steps_take_the_zero_over_reset_and_restart() {
    let place = TestPlace::new();
    let out = place.path("out");
    let arguments = ["--record", "none", "--allow-injection"];
    let run = place.start_instance(NAME, &arguments, &scenario(&place, ""), &out);
    let begun = generation(&place, 1);
    assert_eq!((&begun["homed"], &begun["angle_doubted"]), (&Value::Bool(true), &Value::Bool(false)));
    place.stepvalve(&["arm"]).expect_code(0);
    // Two teeth: by less, arming pulls the rotor to another place than the encoder says.
    place.stepvalve(&["inject", "encoder-jump", "by_rad=0.251327"]).expect_code(0);
    let fault = place.wait_for("the fault", || place.status().filter(|status| status["state"] == "fault"));
    assert_eq!(fault["fault"], "lost steps", "{fault}");
    place.stepvalve(&["reset"]).expect_code(0);
    let told = place.stepvalve(&["status"]).expect_code(0).stdout;
    assert!(told.contains("NOT HOMED: steps were lost") && told.contains("torque reserve   –"), "{told}");
    let refused = place.stepvalve(&["home"]).expect_code(1).stderr;
    assert!(refused.contains("end the instance and start it anew"), "{refused}");
    // What needs the zero is refused, whatever state the controller is in.
    let armed = place.stepvalve(&["arm"]).expect_code(0).stdout;
    assert!(armed.contains("steps were lost since the zero was found"), "{armed}");
    for set in [["set", "angle", "5deg"], ["set", "opening", "0.5"], ["set", "flow", "10L/min"]] {
        let refused = place.stepvalve(&set).expect_code(1).stderr;
        assert!(refused.contains("steps were lost since the zero was found"), "{refused}");
    }
    place.stepvalve(&["set", "hold"]).expect_code(0);
    place.stepvalve(&["disarm"]).expect_code(0);

    kill(place.child_of(run.id(), "step-controller").unwrap(), Signal::SIGKILL).unwrap();
    let again = generation(&place, 2);
    assert_eq!((&again["homed"], &again["angle_doubted"]), (&Value::Bool(false), &Value::Bool(true)));
    end(&place, run);
}

#[test]
fn homing_finds_the_zero_again_that_lost_steps_took() {
    let place = TestPlace::new();
    let homing = "[homing]\nmethod = \"switch\"\nspeed = \"-20deg/s\"\nangle = \"-5deg\"\nlongest = \"200deg\"\n\
                  [homing.simulated]\nswitch = \"-5deg\"\n";
    let arguments = ["--record", "none", "--allow-injection"];
    let run = place.start_instance(NAME, &arguments, &scenario(&place, homing), &place.path("out"));
    generation(&place, 1);
    place.stepvalve(&["arm"]).expect_code(0);
    // Ten teeth down: the way to the switch leads beyond the limits of the zero that was lost.
    place.stepvalve(&["inject", "encoder-jump", "by_rad=-1.256637"]).expect_code(0);
    let fault = place.wait_for("the fault", || place.status().filter(|status| status["state"] == "fault"));
    assert_eq!(fault["fault"], "lost steps", "{fault}");
    place.stepvalve(&["reset"]).expect_code(0);
    place.stepvalve(&["arm"]).expect_code(0);
    let refused = place.stepvalve(&["set", "angle", "5deg"]).expect_code(1).stderr;
    assert!(refused.contains("first, disarmed: stepvalve home"), "{refused}");
    place.stepvalve(&["disarm"]).expect_code(0);
    place.stepvalve(&["home"]).expect_code(0);
    let after = place.status().unwrap();
    assert_eq!(
        (&after["homed"], &after["angle_doubted"]),
        (&Value::Bool(true), &Value::Bool(false)),
        "{after}"
    );
    place.stepvalve(&["disarm"]);
    place.stepvalve(&["arm"]).expect_code(0);
    place.stepvalve(&["set", "angle", "5deg"]).expect_code(0);
    place.wait_for("the angle", || place.status().filter(|status| (degrees(status) - 5.0).abs() < 0.1));
    end(&place, run);
}

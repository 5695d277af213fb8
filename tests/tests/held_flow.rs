//! A flow that is held while the pressure drop changes, and goes out of reach: told by a run's summary and page, by a live instance's status and
//! events.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::Signal;
use std::path::PathBuf;
use stepvalve_tests::{TestPlace, despite_stalls, end_instance};

/// 60 L/min; the pressure drop falls to a hundredth within 0.2 s behind `from_s`, and is back as soon after `low_s`.
fn scenario(place: &TestPlace, from_s: f64, low_s: f64) -> PathBuf {
    let point = |after_s: f64, pressure: &str| {
        format!("    {{ time = \"{:.2}s\", value = \"{pressure}\" }},", from_s + after_s)
    };
    let points = [
        point(0.0, "2MPa"),
        point(0.2, "0.02MPa"),
        point(0.2 + low_s, "0.02MPa"),
        point(0.4 + low_s, "2MPa"),
    ];
    let keys = ["1.5s", "1.9s", "2.7s", "3.5s"].map(|time| format!("    {{ time = \"{time}\""));
    let mut changes: Vec<(&str, &str)> =
        keys.iter().zip(&points).map(|(key, point)| (key.as_str(), point.as_str())).collect();
    changes.extend([
        ("flow = \"40L/min\"", "flow = \"60L/min\""),
        ("flow = \"120L/min\"", "flow = \"60L/min\""),
        ("silence_cycles", "silence_cycles = 100"),
    ]);
    place.scenario("flow-steps.toml", &changes)
}

#[test]
fn a_run_tells_that_a_flow_was_out_of_reach() {
    let place = TestPlace::new();
    let finished = place.simulate(&scenario(&place, 1.1, 0.4), "in-process", "out").expect_code(0);
    // 0.4 s, and what of the fall and the rise is below what 60 L/min need.
    let unheld = finished.summary()["unheld_flow_cycles"].as_u64().unwrap();
    assert!((400..600).contains(&unheld), "{unheld} cycles");
    let run = place.path("out");
    let page = place.path("page.html");
    place.stepvalve(&["report", run.to_str().unwrap(), "--out", page.to_str().unwrap()]).expect_code(0);
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains("held flow: out of reach") && page.contains("held again"));
}

#[test]
fn an_operator_is_told_that_a_flow_is_out_of_reach() {
    despite_stalls(|place| {
        let scenario = scenario(place, 8.0, 2.5);
        let run = place.start_instance("flow", &["--record", "none"], &scenario, &place.path("flow"));
        place.stepvalve(&["arm"]).expect_code(0);
        place.stepvalve(&["set", "flow", "60L/min"]).expect_code(0);
        let held = |wanted: &'static str| {
            place.wait_for(wanted, || place.status().filter(|status| status["held_flow"] == wanted));
        };
        held("held");
        held("out of reach");
        let told = place.stepvalve(&["status"]).expect_code(0).stdout;
        assert!(told.contains("L/min, OUT OF REACH"), "{told}");
        held("held");
        let events = place.stepvalve(&["events"]).expect_code(0).stdout;
        let place_of =
            |text: &str| events.find(text).unwrap_or_else(|| panic!("{text:?} is not in {events}"));
        assert!(place_of("the flow is out of reach: no angle") < place_of("the flow is held again"));
        end_instance(run, Signal::SIGTERM).expect_code(0);
    });
}

//! One instance of a name; any number of different names.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use stepvalve_tests::{Finished, TestPlace, despite_stalls};

#[test]
fn a_second_instance_of_a_name_is_refused_and_another_name_runs_beside() {
    despite_stalls(|place| {
        let scenario = place.shortened("sine-1hz.toml", 2.0, &[]);
        let first = place.start_simulate(&scenario, "realtime", "first", &["--instance", "one"]);
        place.wait_for("the first run", || place.child_of(first.id(), "plant-simulator"));
        let second = place.start_simulate(&scenario, "realtime", "second", &["--instance", "one"]);
        let refused = Finished::from(second.wait_with_output().unwrap()).expect_code(2);
        assert!(refused.stderr.contains("\"one\" is running already"), "{}", refused.stderr);
        assert!(!place.path("second/run-0001.mcap").exists());
        let beside = place.start_simulate(&scenario, "lockstep", "beside", &["--instance", "two"]);
        Finished::from(beside.wait_with_output().unwrap()).expect_code(0);
        let first = Finished::from(first.wait_with_output().unwrap()).expect_code(0);
        assert!(first.summary()["fault"].is_null());
        place.assert_nothing_left(&["one", "two"]);
    });
}

#[test]
fn a_run_is_never_overwritten() {
    let place = TestPlace::new();
    let scenario = place.shortened("sine-1hz.toml", 0.2, &[]);
    place.simulate(&scenario, "in-process", "out").expect_code(0);
    let before = std::fs::read(place.path("out/run.h5")).unwrap();
    let refused = place.simulate(&scenario, "in-process", "out").expect_code(2);
    assert!(refused.stderr.contains("run.h5 exists"), "{}", refused.stderr);
    assert!(before == std::fs::read(place.path("out/run.h5")).unwrap());
}

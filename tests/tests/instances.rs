//! One instance of a name; any number of different names.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use nix::sys::signal::Signal;
use std::path::Path;
use stepvalve_tests::{Finished, TestPlace, despite_stalls, end_instance};

#[test]
fn a_second_instance_of_a_name_is_refused_and_another_name_runs_beside() {
    despite_stalls(|place| {
        let scenario = place.shortened("sine-1hz.toml", 2.0, &[]);
        let first = place.start_simulate(&scenario, "realtime", "first", &["--instance", "one"]);
        place.wait_for("the first run", || place.child_of(first.id(), "plant-simulator"));
        let second = place.start_simulate(&scenario, "realtime", "second", &["--instance", "one"]);
        let refused = Finished::from(second.wait_with_output().unwrap()).expect_code(2);
        assert!(refused.stderr.contains("\"one\" is running already"), "{}", refused.stderr);
        assert!(!place.path("second").exists());
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

/// Two records in one folder stand in each other's way: the second is refused before anything moves.
#[test]
fn a_folder_with_the_record_of_another_instance_is_refused() {
    let place = TestPlace::new();
    let scenario = place.shortened("sine-1hz.toml", 0.2, &[]);
    place.simulate(&scenario, "in-process", "simulated").expect_code(0);
    let run = |name: &str, out: &str| {
        let mut command = place.command("stepvalve");
        command.args(["run", "--instance", name, "--out"]).arg(place.path(out)).arg(&scenario);
        Finished::from(command.output().unwrap())
    };
    let refused = run("one", "simulated").expect_code(2);
    assert!(refused.stderr.contains("simulated holds a simulation's run.h5"), "{}", refused.stderr);
    let first = place.start_instance("one", &["--record", "all"], &scenario, &place.path("out"));
    place.wait_for("its record", || place.path("out/run-0001.mcap").exists().then_some(()));
    let refused = run("two", "out").expect_code(2);
    assert!(refused.stderr.contains("holds the record of the instance \"one\""), "{}", refused.stderr);
    end_instance(first, Signal::SIGTERM).expect_code(0);
    let report = |out: &str| place.stepvalve(&["report", place.path("out").to_str().unwrap(), "--out", out]);
    let refused = report(place.path("no.html").to_str().unwrap()).expect_code(2);
    assert!(refused.stderr.contains("it holds a record") && refused.stderr.contains("stepvalve convert"));
    // A later start of the same instance goes on behind what it wrote before, and says so.
    let again = place.start_instance("one", &["--record", "all"], &scenario, &place.path("out"));
    let again = end_instance(again, Signal::SIGTERM).expect_code(0);
    assert!(again.stderr.contains("holds 1 segment of an earlier start"), "{}", again.stderr);
    assert!(again.stdout.starts_with("stopped\n"), "{}", again.stdout);
    let run = place.path("all.h5");
    let converted = |paths: &[&Path]| {
        let mut command = place.command("stepvalve");
        command.arg("convert").args(paths).arg("--out").arg(&run);
        Finished::from(command.output().unwrap())
    };
    let text = converted(&[&place.path("out")]).expect_code(0).stdout;
    let messages: u64 = text.split(": ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(text.contains(" 0 missing in 0 gaps"), "{text}");
    let file = hdf5::File::open(&run).unwrap();
    assert_eq!(file.group("runs").unwrap().member_names().unwrap(), ["closed-loop", "closed-loop-2"]);
    std::fs::remove_file(&run).unwrap();
    let alone: u64 = ["run-0001.mcap", "run-0002.mcap"]
        .iter()
        .map(|segment| {
            let report = recording::read_record(&[place.path("out").join(segment)], |_| {}).unwrap();
            report.recorded()
        })
        .sum();
    assert_eq!(messages, alone, "none is taken for a repetition of another start's");
    // With another scenario the two are different records.
    let other = place.shortened("sine-1hz.toml", 0.3, &[]);
    let third = place.start_instance("one", &["--record", "all"], &other, &place.path("out"));
    let third = end_instance(third, Signal::SIGTERM).expect_code(0);
    assert!(third.stderr.contains("convert what belongs together"), "{}", third.stderr);
    let refused = converted(&[&place.path("out")]).expect_code(2);
    assert!(refused.stderr.contains("they are different records, to be read apart"), "{}", refused.stderr);
    let parts = ["run-0001.mcap", "run-0002.mcap"].map(|segment| place.path("out").join(segment));
    converted(&[&parts[0], &parts[1]]).expect_code(0);
    place.assert_nothing_left(&["one", "two"]);
}

/// Each start counts its set-points from 1, and a fault keeps the segment that it is in under a name of its own.
#[test]
fn the_set_points_and_faults_of_two_starts_are_on_one_page() {
    despite_stalls(|place| {
        let scenario = place.scenario("step-sequence.toml", &[("silence_cycles", "silence_cycles = 100")]);
        for (angle, fault) in [("11deg", true), ("23deg", false)] {
            let run = place.start_instance("one", &["--allow-injection"], &scenario, &place.path("out"));
            place.arm_when_ready();
            place.stepvalve(&["set", "angle", angle]).expect_code(0);
            place.stepvalve(&["mark", &format!("on the way to {angle}")]).expect_code(0);
            if fault {
                place.stepvalve(&["inject", "drop", "feedback", "count=120"]).expect_code(0);
                place.wait_for("the fault", || place.status().filter(|status| status["state"] == "fault"));
            }
            // Rows are cycles with Feedback: it has to come again.
            std::thread::sleep(std::time::Duration::from_millis(400));
            end_instance(run, Signal::SIGTERM).expect_code(0);
        }
        assert!(place.path("out/run-0001-fault.mcap").exists());
        let [out, run, page] =
            ["out", "all.h5", "all.html"].map(|name| place.path(name).display().to_string());
        place.stepvalve(&["convert", &out, "--out", &run]).expect_code(0);
        let told = place.stepvalve(&["report", &run, "--out", &page]).expect_code(0).stdout;
        assert!(told.contains("feedback silent"), "{told}");
        let page = std::fs::read_to_string(page).unwrap();
        let noted = ["on the way to 11deg", "on the way to 23deg"].map(|note| format!(">{note}</td>"));
        for expected in
            ["11.0°", "23.0°", "started anew: closed-loop-2"].map(str::to_owned).into_iter().chain(noted)
        {
            assert!(page.contains(&expected), "{expected} is not on the page");
        }
    });
}

//! The page of a run: made by `simulate`, readable in a browser, and never half-written.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use serde_json::Value;
use std::path::Path;
use std::process::Command;
use stepvalve_tests::{Finished, TestPlace, despite_stalls, repository};
use test_needs::python_with_browser;

/// What every run of the loop shows.
const PANELS: [&str; 6] =
    ["Angle", "Following error", "Torque and friction", "Torque reserve", "Pulse rate", "Pressure and flow"];
/// What a run in real time shows beside it.
const TIMING: [&str; 2] = ["Wake-up latency", "Time spent in the cycle"];

#[track_caller]
fn look_at(page: &Path, panels: &[&str]) {
    let Some(python) = python_with_browser() else { return };
    let script = repository().join("tests/browser/test_run_page.py");
    let output = Command::new(python).arg(script).arg(page).args(panels).output().unwrap();
    let finished = Finished::from(output).expect_code(0);
    print!("{}", finished.stdout);
}

/// The sentence under a page's title.
fn headline(page: &Path) -> String {
    let html = std::fs::read_to_string(page).unwrap();
    let begin = html.split("<p class=\"headline\">").nth(1).expect("a headline");
    begin.split("</p>").next().unwrap().to_owned()
}

#[test]
fn simulate_leaves_a_page_that_a_browser_shows() {
    despite_stalls(|place| {
        let scenario = place.scenario("flow-steps.toml", &[]);
        for (mode, panels) in [("realtime", [&PANELS[..], &TIMING].concat()), ("in-process", PANELS.to_vec())]
        {
            let finished = place.simulate(&scenario, mode, mode).expect_code(0);
            let page = place.path(mode).join("run.html");
            assert!(finished.stdout.contains(page.to_str().unwrap()), "{}", finished.stdout);
            assert!(headline(&page).contains("no fault"), "{}", headline(&page));
            look_at(&page, &panels);
        }
    });
}

/// What a fact of the page says.
fn fact(page: &Path, name: &str) -> String {
    let html = std::fs::read_to_string(page).unwrap();
    let found = html.split(&format!("<dt>{name}</dt><dd>")).nth(1).expect(name);
    found.split("</dd>").next().unwrap().to_owned()
}

#[test]
fn the_page_counts_the_overruns_that_simulate_counts() {
    let place = TestPlace::new();
    let scenario = place.shortened("step-sequence.toml", 0.5, &[]);
    let summary = |out: &str, options: &[&str]| -> Value {
        let run = place.start_simulate(&scenario, "realtime", out, options);
        let finished = Finished::from(run.wait_with_output().unwrap());
        serde_json::from_str(&finished.stdout).unwrap_or_else(|_| panic!("{}", finished.stderr))
    };
    let last = summary("plain", &[])["cycles"].as_u64().unwrap() - 1;
    // One in the middle, and one in the last cycle, behind which no further message counts it.
    let faults = [200, last].map(|at| format!("overrun step-controller cycles=2 at={at}"));
    let [first, second] = faults.each_ref().map(String::as_str);
    let options = ["--allow-injection", "--inject", first, "--inject", second];
    let said = summary("late", &options);
    let sum = |key: &str| -> u64 {
        let processes = said["processes"].as_object().unwrap().values();
        processes.filter_map(|process| process["timing"][key].as_u64()).sum()
    };
    let (overruns, skipped) = (sum("overruns"), sum("skipped_cycles"));
    assert!(overruns >= 2, "{overruns} overruns: the faults did not happen");
    let cycles = if skipped == 1 { "cycle" } else { "cycles" };
    assert_eq!(
        fact(&place.path("late/run.html"), "Overruns"),
        format!("{overruns}, {skipped} {cycles} skipped")
    );
}

#[test]
fn a_fault_is_what_the_page_says_first() {
    let place = TestPlace::new();
    // The paper's parameters can't turn: the spool stays behind.
    let limit = ("max_following_error", "max_following_error = \"3deg\"");
    let scenario = place.scenario("paper-initial.toml", &[limit]);
    place.simulate(&scenario, "in-process", "out").expect_code(3);
    let said = headline(&place.path("out/run.html"));
    assert!(said.starts_with("Stopped by a fault at 0."), "{said}");
    assert!(said.contains("following error"), "{said}");
}

#[test]
fn report_makes_the_same_page_and_overwrites_nothing() {
    let place = TestPlace::new();
    let scenario = place.shortened("step-sequence.toml", 1.0, &[]);
    place.simulate(&scenario, "in-process", "out").expect_code(0);
    let (run, page) = (place.path("out/run.h5"), place.path("page.html"));
    let report = |run: &Path, out: &Path| {
        place.stepvalve(&["report", run.to_str().unwrap(), "--out", out.to_str().unwrap()])
    };
    for (source, page) in [(&run, &page), (&place.path("out"), &place.path("of-folder.html"))] {
        report(source, page).expect_code(0);
        assert_eq!(std::fs::read(page).unwrap(), std::fs::read(place.path("out/run.html")).unwrap());
    }
    let before = std::fs::read(&run).unwrap();
    let refused = report(&run, &run).expect_code(2);
    assert!(refused.stderr.contains("exists"), "{}", refused.stderr);
    assert_eq!(std::fs::read(&run).unwrap(), before);
    let refused = report(&run, &place.path("no-such-folder/page.html")).expect_code(2);
    assert!(refused.stderr.contains("there is no folder"), "{}", refused.stderr);
}

#[test]
fn bad_files_are_refused_and_nothing_is_written() {
    let place = TestPlace::new();
    let scenario = place.shortened("step-sequence.toml", 0.5, &[]);
    place.simulate(&scenario, "in-process", "out").expect_code(0);
    let whole = std::fs::read(place.path("out/run.h5")).unwrap();
    let cut = place.path("cut.h5");
    std::fs::write(&cut, &whole[..whole.len() / 2]).unwrap();
    let text = place.write("text.h5", "not HDF5");
    let pages = place.path("pages");
    let no_run = place.path("no-run");
    std::fs::create_dir(&pages).unwrap();
    std::fs::create_dir(&no_run).unwrap();
    for bad in [cut, text, place.path("missing.h5"), no_run] {
        let out = pages.join("page.html");
        let refused = place.stepvalve(&["report", bad.to_str().unwrap(), "--out", out.to_str().unwrap()]);
        let refused = refused.expect_code(2);
        assert!(refused.stderr.contains(bad.to_str().unwrap()), "{}", refused.stderr);
        assert_eq!(std::fs::read_dir(&pages).unwrap().count(), 0, "something was written");
    }
}

#[test]
fn two_runs_stand_on_one_page() {
    let place = TestPlace::new();
    let given = place.shortened("sine-1hz.toml", 5.0, &[]);
    place.simulate(&given, "in-process", "full").expect_code(0);
    let bare = place.shortened("sine-1hz.toml", 5.0, &[("level", "level = \"none\"")]);
    place.simulate(&bare, "in-process", "none").expect_code(0);
    let compare = |a: &str, b: &str, out: &str| {
        let paths = [a, b, out].map(|name| place.path(name).to_str().unwrap().to_owned());
        place.stepvalve(&["compare", &paths[0], &paths[1], "--out", &paths[2]])
    };
    // A run's folder, and a file.
    let finished = compare("full", "none/run.h5", "both.html").expect_code(0);
    let page = place.path("both.html");
    let said = headline(&page);
    assert!(said.starts_with("Following error: 0.0") && finished.stdout.contains(&said), "{said}");
    let html = std::fs::read_to_string(&page).unwrap();
    for line in [
        "A  level = &quot;full&quot;",
        "B  level = &quot;none&quot;",
        "A angle",
        "B angle",
        "A state",
        "B state",
    ] {
        assert!(html.contains(line), "{line} is not on the page");
    }
    look_at(&page, &PANELS);
    // The same run twice: nothing differs.
    compare("full", "full", "same.html").expect_code(0);
    let html = std::fs::read_to_string(place.path("same.html")).unwrap();
    assert!(html.contains("both were made from the same texts"));
    let before = std::fs::read(&page).unwrap();
    compare("full", "none", "both.html").expect_code(2);
    assert_eq!(std::fs::read(&page).unwrap(), before);
    for (a, b, named) in [("missing", "full", "missing"), ("full", "missing.h5", "missing.h5")] {
        let refused = compare(a, b, "other.html").expect_code(2);
        assert!(refused.stderr.contains(named), "{}", refused.stderr);
        assert!(!place.path("other.html").exists());
    }
}

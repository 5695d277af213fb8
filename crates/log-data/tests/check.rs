//! A good log passes; each flaw is found and named with run and row.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::*;

fn run(name: &str, start_s: f64) -> Run {
    Run {
        name: name.into(),
        kind: "sine".into(),
        time_s: (0..5).map(|row| start_s + f64::from(row) * 0.1).collect(),
        angle_rad: vec![0.0, 0.1, f64::NAN, 0.1, 0.0],
        torque_nm: Some(vec![1.0; 5]),
        extra: vec![Extra { name: "current".into(), unit: "A".into(), values: vec![0.0; 5] }],
        ..Run::default()
    }
}

fn log() -> Log {
    Log { title: "rig".into(), runs: vec![run("b", 1.0), run("a", 0.0)], ..Log::default() }
}

/// The message for a log with a flaw in its second run.
fn flawed(spoil: impl FnOnce(&mut Run)) -> String {
    let mut log = log();
    spoil(&mut log.runs[1]);
    log.check().unwrap_err().to_string()
}

#[test]
fn a_good_log_passes_missing_samples_included() {
    assert_eq!(log().check(), Ok(()));
}

type Case = (fn(&mut Run), &'static str);

#[test]
fn each_flaw_is_named_with_its_place() {
    let cases: &[Case] = &[
        (
            |run| run.time_s[3] = run.time_s[2],
            "run a, row 4: time is 0.2 s after 0.2 s, expected it to increase",
        ),
        (|run| run.time_s[2] = f64::NAN, "run a, row 3: time is NaN, expected a finite number"),
        (|run| run.angle_rad.truncate(4), "run a: angle has 4 samples, expected 5 as time has"),
        (|run| run.extra[0].values.push(0.0), "run a: current has 6 samples, expected 5 as time has"),
        (
            |run| run.torque_nm.as_mut().unwrap()[1] = f64::INFINITY,
            "run a, row 2 (time 0.1 s): torque is inf, expected a finite number or NaN",
        ),
        (|run| run.angle_rad.fill(f64::NAN), "run a: angle has no valid sample, expected at least one"),
        (|run| *run = Run { name: "a".into(), ..Run::default() }, "run a: time has no valid sample"),
        (|run| run.name = "b".into(), "log: the name \"b\" occurs twice"),
        (|run| run.name = "x/y".into(), "log: the name \"x/y\" is empty"),
        (|run| run.extra[0].name = "torque".into(), "run a: the name \"torque\" occurs twice"),
    ];
    for (spoil, expected) in cases {
        let found = flawed(spoil);
        assert!(found.starts_with(expected), "found {found:?}, expected {expected:?}");
    }
    assert_eq!(Log::default().check(), Err(LogError::NoRuns));
}

#[test]
fn time_gives_the_order_of_runs() {
    let mut log = log();
    assert_eq!(log.runs_in_time().iter().map(|run| run.name.as_str()).collect::<Vec<_>>(), ["a", "b"]);
    assert!(log.is_on_one_clock());
    log.runs[0] = run("b", 0.2);
    assert!(!log.is_on_one_clock());
}

#[test]
fn channels_are_found_by_name_and_set_by_channel() {
    let mut run = run("a", 0.0);
    for (number, channel) in (0..).zip(Channel::ALL) {
        assert_eq!(Channel::from_name(channel.name()), Some(*channel));
        run.set_channel(*channel, vec![f64::from(number); 5]);
    }
    for (number, channel) in (0..).zip(Channel::ALL) {
        assert_eq!(run.channel(*channel), Some(&[f64::from(number); 5][..]));
    }
}

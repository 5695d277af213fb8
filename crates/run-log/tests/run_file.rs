//! A log read a column at a time gives what the whole log gives, and believes as little.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::{Extra, Log, Run};
use run_log::{RunFile, RunLogError, write_log};
use std::path::Path;

/// Longer than a block, so that blocks meet.
const ROWS: usize = 70_000;

fn run(name: &str, begin_s: f64, rows: usize) -> Run {
    let time_s: Vec<f64> = (0..rows).map(|k| begin_s + k as f64 * 1e-3).collect();
    let angle_rad = time_s.iter().map(|time| time.sin()).collect();
    Run { name: name.into(), kind: "sine".into(), time_s, angle_rad, ..Run::default() }
}

fn written(path: &Path) -> Log {
    let mut late = run("a-late", 1000.0, 10);
    late.extra.push(Extra { name: "state".into(), unit: "1".into(), values: vec![3.0; 10] });
    // Not in the order of their names.
    let log = Log { title: "two".into(), runs: vec![late, run("b-early", 0.0, ROWS)], ..Log::default() };
    write_log(path, &log).unwrap();
    log
}

fn column(file: &RunFile, name: &str) -> Option<Vec<f64>> {
    file.column(name, |values| values.collect()).unwrap()
}

#[test]
fn runs_stand_in_the_order_of_time_with_a_gap_between() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.h5");
    let log = written(&path);
    let file = RunFile::open(&path).unwrap();
    let spans: Vec<_> = file.spans().map(|span| (span.name.as_str(), span.rows.clone())).collect();
    assert_eq!(spans, [("b-early", 0..ROWS), ("a-late", ROWS + 1..ROWS + 11)]);
    assert_eq!((file.rows(), file.text("title").unwrap().as_deref()), (ROWS + 11, Some("two")));
    let times = file.times_s().unwrap();
    assert_eq!(times.len(), ROWS + 11);
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    assert!((times[ROWS] - times[ROWS - 1] - 1e-3).abs() < 1e-9, "nothing goes on until the late run");
    let angle = column(&file, "angle").unwrap();
    assert_eq!(angle[..ROWS], log.runs[1].angle_rad);
    assert!(angle[ROWS].is_nan());
    assert_eq!(angle[ROWS + 1..], log.runs[0].angle_rad);
    let state = column(&file, "state").unwrap();
    assert!(state[..=ROWS].iter().all(|value| value.is_nan()), "the early run has no such column");
    assert_eq!(state[ROWS + 1..], [3.0; 10]);
    assert_eq!(column(&file, "flow"), None);
    assert!(file.processes().unwrap().is_empty() && file.notes().unwrap().is_empty());
}

#[test]
fn what_a_reader_leaves_unread_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.h5");
    written(&path);
    let file = RunFile::open(&path).unwrap();
    assert_eq!(file.column("time", |times| times.next()).unwrap(), Some(Some(0.0)));
}

#[test]
fn columns_that_break_the_format_are_refused_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.h5");
    written(&path);
    {
        let file =
            hdf5::File::with_options().with_fapl(|access| access.file_locking(false)).open_rw(&path).unwrap();
        let group = file.group("runs/a-late").unwrap();
        group.new_dataset_builder().with_data(&[1.0; 3]).create("torque").unwrap();
        group.unlink("time").unwrap();
        group
            .new_dataset_builder()
            .with_data(&[2.0, 1.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0])
            .create("time")
            .unwrap();
    }
    let file = RunFile::open(&path).unwrap();
    let short = file.column("torque", |values| values.count()).unwrap_err();
    assert!(matches!(&short, RunLogError::Format { place, .. } if place.contains("torque")), "{short}");
    let time = file.times_s().unwrap_err();
    assert!(matches!(&time, RunLogError::Format { place, .. } if place == "time"), "{time}");
}

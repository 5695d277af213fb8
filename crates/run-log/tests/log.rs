//! Valve-logs: written and read back the same; files with flaws are refused with the flaw's place.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::*;
use proptest::prelude::*;
use run_log::{RunLogError, read_log, write_log};
use std::path::Path;

fn sample() -> Log {
    let run = Run {
        name: "sine 1 Hz".into(),
        kind: "sine".into(),
        attributes: [("pressure_pa".to_owned(), Attribute::Number(5e6))].into(),
        time_s: vec![0.0, 0.001, 0.002],
        angle_rad: vec![0.0, f64::NAN, 0.2],
        torque_nm: Some(vec![1.0, 2.0, 3.0]),
        extra: vec![Extra { name: "current".into(), unit: "A".into(), values: vec![1.0; 3] }],
        ..Run::default()
    };
    Log {
        title: "Prüfstand".into(),
        provenance: Some("rig 3".into()),
        angle_zero: AngleZero::PerRun,
        attributes: [("operator".to_owned(), Attribute::Text("Ada".into()))].into(),
        runs: vec![run],
    }
}

/// NaN compares as equal here.
fn same(a: &Log, b: &Log) -> bool {
    format!("{a:?}") == format!("{b:?}")
}

/// Writes the sample, lets `spoil` at the file, and gives the reader's message.
fn refusal(spoil: impl FnOnce(&hdf5::File)) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.h5");
    write_log(&path, &sample()).unwrap();
    let file = hdf5::File::open_rw(&path).unwrap();
    spoil(&file);
    file.close().unwrap();
    let message = read_log(&path).unwrap_err().to_string();
    message.strip_prefix(&format!("{}: ", path.display())).expect("the file's name comes first").to_owned()
}

fn replace<T: hdf5::H5Type>(file: &hdf5::File, name: &str, unit: &str, values: &[T]) {
    let run = file.group("runs/sine 1 Hz").unwrap();
    run.unlink(name).unwrap();
    let dataset = run.new_dataset_builder().with_data(values).create(name).unwrap();
    let unit: hdf5::types::VarLenAscii = hdf5::types::VarLenAscii::from_ascii(unit).unwrap();
    dataset.new_attr::<hdf5::types::VarLenAscii>().create("unit").unwrap().write_scalar(&unit).unwrap();
}

#[test]
fn what_is_written_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.h5");
    write_log(&path, &sample()).unwrap();
    assert!(same(&read_log(&path).unwrap(), &sample()));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left in the folder");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_samples_come_back_bit_for_bit(rows in 1_usize..40_000, seed: u64) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.h5");
        let mut log = sample();
        let run = &mut log.runs[0];
        run.extra.clear();
        for channel in Channel::ALL {
            let value = |row: usize| (seed.rotate_left(row as u32 % 64) >> 12) as f64 / (row + 1) as f64;
            run.set_channel(*channel, (0..rows).map(value).collect());
        }
        run.time_s = (0..rows).map(|row| row as f64 * 1e-3).collect();
        write_log(&path, &log).unwrap();
        prop_assert!(read_log(&path).unwrap() == log);
    }
}

#[test]
fn each_flaw_of_a_file_is_named_with_its_place() {
    let wrong_unit = refusal(|file| replace(file, "angle", "deg", &[0.0, 1.0, 2.0]));
    assert_eq!(wrong_unit, "/runs/sine 1 Hz/angle: found unit \"deg\", expected unit \"rad\"");
    let short = refusal(|file| replace(file, "torque", "N*m", &[0.0, 1.0]));
    assert_eq!(short, "run sine 1 Hz: torque has 2 samples, expected 3 as time has");
    let backwards = refusal(|file| replace(file, "time", "s", &[0.0, 2.0, 1.0]));
    assert_eq!(backwards, "run sine 1 Hz, row 3: time is 1 s after 2 s, expected it to increase");
    let no_time = refusal(|file| file.unlink("runs/sine 1 Hz/time").unwrap());
    assert_eq!(no_time, "/runs/sine 1 Hz: found no dataset time, expected one");
    let no_runs = refusal(|file| file.unlink("runs").unwrap());
    assert_eq!(no_runs, "root: found no group /runs, expected one");
    let version = refusal(|file| file.attr("format_version").unwrap().write_scalar(&2_i64).unwrap());
    assert_eq!(version, "attribute format_version: found 2, expected 1");
    let format = refusal(|file| file.delete_attr("format").unwrap());
    assert_eq!(format, "attribute format: found none, expected \"valve-log\"");
    let zero = refusal(|file| {
        let value: hdf5::types::VarLenUnicode = "mine".parse().unwrap();
        file.attr("angle_zero").unwrap().write_scalar(&value).unwrap();
    });
    assert_eq!(zero, "attribute angle_zero: found \"mine\", expected \"common\" or \"per-run\"");
}

#[test]
fn single_precision_and_texts_of_fixed_length_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.h5");
    write_log(&path, &sample()).unwrap();
    let file = hdf5::File::open_rw(&path).unwrap();
    replace(&file, "torque", "N*m", &[0.5_f32, 1.5, 2.5]);
    file.delete_attr("title").unwrap();
    let title = hdf5::types::FixedAscii::<3>::from_ascii("rig").unwrap();
    file.new_attr::<hdf5::types::FixedAscii<3>>().create("title").unwrap().write_scalar(&title).unwrap();
    file.close().unwrap();
    let log = read_log(&path).unwrap();
    assert_eq!(log.runs[0].torque_nm.as_deref(), Some(&[0.5, 1.5, 2.5][..]));
    assert_eq!(log.title, "rig");
}

#[test]
fn a_file_that_claims_more_samples_than_fit_is_refused_before_any_is_read() {
    let message = refusal(|file| {
        let run = file.group("runs/sine 1 Hz").unwrap();
        run.unlink("torque").unwrap();
        let huge =
            run.new_dataset::<f64>().chunk(1024).shape(1_000_000_000_000_usize).create("torque").unwrap();
        let unit: hdf5::types::VarLenUnicode = "N*m".parse().unwrap();
        huge.new_attr::<hdf5::types::VarLenUnicode>().create("unit").unwrap().write_scalar(&unit).unwrap();
    });
    assert!(message.starts_with("/runs/sine 1 Hz/torque: found more samples, expected at most"), "{message}");
}

#[test]
fn files_of_other_kinds_and_cut_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.h5");
    assert!(matches!(read_log(&path), Err(RunLogError::Io { .. })));
    std::fs::write(&path, "time,angle\n0,0\n").unwrap();
    let message = read_log(&path).unwrap_err().to_string();
    assert!(
        message.contains("found no HDF5, expected a valve-log, which stepvalve import makes"),
        "{message}"
    );
    write_log(&path, &sample()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for length in (0..bytes.len()).step_by(97) {
        std::fs::write(&path, &bytes[..length]).unwrap();
        assert!(read_log(&path).is_err(), "cut at {length}");
    }
}

#[test]
fn a_bad_log_is_not_written_and_leaves_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.h5");
    write_log(&path, &sample()).unwrap();
    let mut bad = sample();
    bad.runs[0].time_s[2] = 0.0;
    assert!(matches!(write_log(&path, &bad), Err(RunLogError::Log { .. })));
    assert!(same(&read_log(&path).unwrap(), &sample()));
    let nowhere = Path::new("/nonexistent/log.h5");
    assert!(matches!(write_log(nowhere, &sample()), Err(RunLogError::Io { .. })));
}

//! A record becomes a run file: every bit, the table of cycles, and what is missing.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

#[path = "../../recording/tests/common/mod.rs"]
mod common;

use common::*;
use log_data::Channel;
use recording::{AnyMessage, Gap, RecordInfo, Topic, Writer};
use run_log::{RunLogError, convert, read_log};
use signals::*;
use std::path::Path;

/// A record of feedback and truth with known contents; `skip` tells which cycles' feedback is lost.
fn known_record(path: &Path, cycles: u64, skip: impl Fn(u64) -> bool, validity: u64) {
    let mut writer = Writer::create(path, &info()).unwrap();
    for k in 0..cycles {
        let header = |source, cycle| Header { source, ..known_header(k, cycle) };
        let feedback = Feedback {
            angle_rad: k as f64,
            accepted_microsteps: 10 * k as i64,
            pressure_drop_pa: 5e6,
            validity,
            ..Feedback::default()
        };
        if !skip(k) {
            let message = seal::<Feedback>(header(Source::Plant.code(), k), feedback);
            writer.write(Source::Plant, &message).unwrap();
        }
        let truth = PlantTruth { angle_rad: k as f64 + 0.25, load_torque_nm: -1.5, ..PlantTruth::default() };
        let message = seal::<PlantTruth>(header(Source::Plant.code(), k), truth);
        writer.write(Source::Plant, &message).unwrap();
        let reference = Reference { angle_rad: k as f64 + 2.5, ..Reference::default() };
        let message = seal::<Reference>(header(Source::Trajectory.code(), k + 2), reference);
        writer.write(Source::Trajectory, &message).unwrap();
    }
    writer.finish().unwrap();
}

fn known_header(sequence: u64, cycle: u64) -> Header {
    Header { sequence, cycle, monotonic_ns: sequence * PERIOD_NS, ..Header::default() }
}

fn seal<B: Body>(header: Header, body: B) -> Message<B> {
    Message::seal(Header { schema_hash: B::SCHEMA_HASH, ..header }, body)
}

/// Without HDF5's lock, which the child of another test would inherit.
fn open(path: &Path) -> hdf5::File {
    hdf5::File::with_options().with_fapl(|access| access.file_locking(false)).open(path).unwrap()
}

fn column(file: &hdf5::File, name: &str) -> Vec<f64> {
    file.dataset(name).unwrap().read_raw().unwrap()
}

#[test]
fn rows_are_cycles_and_missing_samples_are_nan() {
    let folder = tempfile::tempdir().unwrap();
    let (record, run) = (folder.path().join("REC-0001.mcap"), folder.path().join("run.h5"));
    let skip = |k| k == 4;
    known_record(&record, 10, skip, validity::ENCODER | validity::PRESSURE);
    let summary = convert(&[&record], &run).unwrap();
    assert_eq!(summary.cycles, [10]);
    assert_eq!(summary.report.missed(), 1);

    let log = read_log(&run).unwrap();
    let run = log.run("closed-loop").unwrap();
    assert_eq!((run.kind.as_str(), log.title.as_str()), ("closed-loop", "step sequence"));
    assert_eq!(run.time_s[9], 0.009);
    let expect = |name: &str, value: fn(f64) -> f64, skip: fn(u64) -> bool| {
        let values = match Channel::from_name(name) {
            Some(channel) => run.channel(channel).unwrap(),
            None => &run.extra(name).unwrap().values,
        };
        for (k, found) in (0..).zip(values) {
            assert_eq!(found.is_nan(), skip(k), "{name} at {k}");
            assert!(skip(k) || *found == value(k as f64), "{name} at {k}: {found}");
        }
    };
    expect("angle", |k| k, |k| k == 4);
    expect("pressure_drop", |_| 5e6, |k| k == 4);
    expect("torque", |_| -1.5, |_| false);
    expect("true_angle", |k| k + 0.25, |_| false);
    // Reference k+2 is k + 2.5; there is none for the first two cycles.
    expect("reference_angle", |k| k + 0.5, |k| k < 2);
    expect("following_error", |_| 0.5, |k| k < 2 || k == 4);
    expect("true_following_error", |_| 0.25, |k| k < 2);
    assert!(run.oil_temperature_c.is_none());
    assert!(run.extra("friction_estimate").is_none(), "no ControlStatus was recorded");
}

#[test]
fn the_angle_says_where_it_comes_from() {
    let folder = tempfile::tempdir().unwrap();
    for (flags, expected, first) in [(validity::ENCODER, "encoder", 0.0), (0, "truth", 0.25)] {
        let (record, run) = (folder.path().join(expected), folder.path().join("run.h5"));
        known_record(&record, 3, |_| false, flags);
        convert(&[&record], &run).unwrap();
        let file = open(&run);
        let angle = file.dataset("runs/closed-loop/angle").unwrap();
        let source: hdf5::types::VarLenUnicode = angle.attr("source").unwrap().read_scalar().unwrap();
        assert_eq!((source.as_str(), angle.read_raw::<f64>().unwrap()[0]), (expected, first));
    }
}

#[test]
fn every_bit_of_every_message_is_in_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let (record, run) = (folder.path().join("REC-0001.mcap"), folder.path().join("run.h5"));
    // More than one block, so that columns grow.
    let mut messages = common::record(&record, 3, 17_000, 20);
    convert(&[&record], &run).unwrap();
    let file = open(&run);
    for topic in [Topic::Feedback, Topic::ControlStatus, Topic::PlantTiming] {
        let rows: Vec<Vec<u64>> = messages.iter().filter(|m| m.topic() == Some(topic)).map(words).collect();
        let fields = Header::FIELDS.iter().chain(topic.body_fields());
        for (index, field) in fields.enumerate() {
            let place = format!("messages{}/{}", topic.path(), field.name);
            let dataset = file.dataset(&place).unwrap();
            let found: Vec<u64> = match field.kind {
                Kind::U64 => dataset.read_raw::<u64>().unwrap(),
                Kind::I64 => dataset.read_raw::<i64>().unwrap().into_iter().map(i64::cast_unsigned).collect(),
                Kind::F64 => dataset.read_raw::<f64>().unwrap().into_iter().map(f64::to_bits).collect(),
            };
            let expected: Vec<u64> = rows.iter().map(|row| row[index]).collect();
            assert!(found == expected, "{place}");
        }
    }
    messages.clear();
    let latency = column(&file, "timing/step_controller/wake_up_latency_ns");
    assert_eq!(latency.len(), 17_000);
    let text = file.dataset("scenario/text").unwrap().read_scalar::<hdf5::types::VarLenUnicode>().unwrap();
    assert_eq!(text.as_str(), info().texts.scenario);
}

fn words(message: &AnyMessage) -> Vec<u64> {
    let mut words = Vec::new();
    message.each_word(|word| words.push(word));
    words
}

#[test]
fn two_records_of_one_lockstep_run_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["a", "b"].map(|name| {
        let (record, run) = (folder.path().join(name), folder.path().join(format!("{name}.h5")));
        common::record(&record, 9, 17_000, if name == "a" { 20 } else { 7 });
        convert(&[&record], &run).unwrap();
        // HDF5's time stamps count seconds.
        std::thread::sleep(std::time::Duration::from_millis(1100));
        std::fs::read(run).unwrap()
    });
    assert!(files[0] == files[1]);
}

#[test]
fn a_second_generation_is_a_run_of_its_own_on_the_same_clock() {
    let folder = tempfile::tempdir().unwrap();
    let (record, run) = (folder.path().join("REC-0001.mcap"), folder.path().join("run.h5"));
    let mut writer = Writer::create(&record, &info()).unwrap();
    for (generation, start_ns) in [(1, 7_000_000), (2, 3_007_400_000)] {
        for k in 0..5 {
            let monotonic_ns = start_ns + k * PERIOD_NS;
            let header =
                Header { generation, monotonic_ns, source: Source::Plant.code(), ..known_header(k, k) };
            writer.write(Source::Plant, &seal(header, Feedback::default())).unwrap();
        }
    }
    writer.note_gap(&Gap { topic: Topic::Reference, generation: 2, first_missing: 0, missed: 3 }).unwrap();
    writer.finish().unwrap();
    let summary = convert(&[&record], &run).unwrap();
    assert_eq!(summary.cycles, [5, 5]);
    let log = read_log(&run).unwrap();
    assert!(log.is_on_one_clock());
    assert_eq!(log.run("closed-loop-2").unwrap().time_s, [3.0, 3.001, 3.002, 3.003, 3.004]);
    let file = open(&run);
    assert_eq!(column(&file, "gaps/missed"), [3.0]);
}

#[test]
fn a_record_without_cycles_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let (record, run) = (folder.path().join("REC-0001.mcap"), folder.path().join("run.h5"));
    Writer::create(&record, &RecordInfo { ..info() }).unwrap().finish().unwrap();
    assert!(matches!(convert(&[&record], &run), Err(RunLogError::NoCycles { .. })));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// The disk fills up in the middle: a file size limit stands for it, set with `ulimit` in a child shell.
#[test]
fn a_full_disk_is_an_error_and_leaves_what_was_there() {
    const LIMITED: &str = "STEPVALVE_TEST_LIMITED";
    let paths = |folder: &Path| (folder.join("REC-0001.mcap"), folder.join("run.h5"));
    if let Some(folder) = std::env::var_os(LIMITED) {
        let (record, run) = paths(Path::new(&folder));
        let error = convert(&[record], &run).unwrap_err().to_string();
        assert!(error.contains("File too large"), "{error}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (record, run) = paths(folder.path());
    common::record(&record, 6, 2000, 20);
    std::fs::write(&run, "an earlier run").unwrap();
    for limit_kb in [1, 100, 1000] {
        // Without SIGXFSZ a write past the limit fails with EFBIG, as one on a full disk does with ENOSPC.
        let script = format!("trap '' XFSZ; ulimit -f {limit_kb}; exec \"$0\" --exact \"$1\"");
        let status = std::process::Command::new("bash")
            .args(["-c", &script])
            .arg(std::env::current_exe().unwrap())
            .arg("a_full_disk_is_an_error_and_leaves_what_was_there")
            .env(LIMITED, folder.path())
            .stdout(std::process::Stdio::null())
            .status()
            .unwrap();
        assert!(status.success(), "limit {limit_kb} kB: {status}");
        assert_eq!(std::fs::read(&run).unwrap(), b"an earlier run");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "a partial file was left");
    }
}

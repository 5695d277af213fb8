//! Files open in other people's programs: h5py, and the public MCAP reader, through the scripts in `tools/`.
//!
//! They need Python with `tools/requirements.txt` (`test_needs::python`).
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

#[path = "../../recording/tests/common/mod.rs"]
mod common;

use recording::{Gap, Topic, Writer};
use run_log::{convert, read_log};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use test_needs::python;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// What the scripts in tools/ import.
const MODULES: [&str; 4] = ["h5py", "matplotlib", "mcap", "mcap_ros2"];

fn run(python: &Path, arguments: &[&OsStr]) -> Output {
    let output = Command::new(python).args(arguments).env("MPLBACKEND", "Agg").output().unwrap();
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{arguments:?}\n{out}\n{err}");
    output
}

#[test]
fn the_public_reader_decodes_a_record_whole_or_cut() {
    let Some(python) = python(&MODULES) else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("REC-0001.mcap");
    let mut dice = common::Dice(1);
    let mut writer = Writer::create(&path, &common::info()).unwrap();
    for k in 0..100 {
        common::cycle_messages(&mut dice, k).iter().for_each(|message| common::write(&mut writer, message));
    }
    writer.note_gap(&Gap { topic: Topic::SetPoint, generation: 0, first_missing: 7, missed: 3 }).unwrap();
    writer.note("the disk was slow").unwrap();
    writer.flush().unwrap();
    let flushed = std::fs::read(&path).unwrap();
    writer.finish().unwrap();

    let script = root().join("tools/read_mcap.py");
    let read =
        |path: &Path| String::from_utf8(run(&python, &[script.as_ref(), path.as_ref()]).stdout).unwrap();
    let whole = read(&path);
    let mut last = None;
    recording::read_record(&[&path], |message| last = Some(*message)).unwrap();
    let Some(recording::AnyMessage::LoopTiming(_, last)) = last else { panic!("{last:?}") };
    assert!(whole.contains("/feedback: 100 messages"), "{whole}");
    assert!(whole.contains(&format!("    deadline_ns = {}\n", last.body.deadline_ns)), "{whole}");
    assert!(whole.contains("    first_missing = 7\n    missed = 3\n    topic = /set_point\n"), "{whole}");
    assert!(whole.contains("    text = the disk was slow\n"), "{whole}");
    assert!(!whole.contains("no proper end"));

    let cut = folder.path().join("cut.mcap");
    std::fs::write(&cut, flushed).unwrap();
    let cut = read(&cut);
    assert!(cut.contains("/feedback: 100 messages") && cut.contains("no proper end"), "{cut}");
}

#[test]
fn h5py_reads_a_run_and_the_script_plots_it() {
    let Some(python) = python(&MODULES) else { return };
    let folder = tempfile::tempdir().unwrap();
    let [record, file, picture] = ["REC-0001.mcap", "run.h5", "run.png"].map(|name| folder.path().join(name));
    common::record(&record, 5, 20_000, 20);
    convert(&[&record], &file).unwrap();
    let plot = root().join("tools/plot_run.py");
    run(&python, &[plot.as_ref(), file.as_ref(), picture.as_ref()]);
    assert!(std::fs::read(&picture).unwrap().starts_with(b"\x89PNG"));

    let script = "import sys, h5py, math
log = h5py.File(sys.argv[1])
assert log.attrs['format'] == 'valve-log' and log.attrs['format_version'] == 1, dict(log.attrs)
assert log['scenario/text'][()].decode() == 'name = \"µ\"\\n', log['scenario/text'][()]
run = log['runs/closed-loop']
assert run.attrs['kind'] == 'closed-loop'
for name, column in run.items():
    assert column.dtype == 'float64' and column.shape == run['time'].shape, name
    assert isinstance(column.attrs['unit'], str), name
assert log['messages/feedback/encoder_counts'].dtype == 'int64'
assert log['messages/feedback/cycle'].dtype == 'uint64'
assert run['state'].attrs['codes'].startswith('0 disarmed')
print(math.fsum(run['true_angle'][:1000]).hex())";
    let output = run(&python, &["-c".as_ref(), script.as_ref(), file.as_ref()]);
    let sum = String::from_utf8(output.stdout).unwrap();
    let log = read_log(&file).unwrap();
    let ours = &log.runs[0].extra("true_angle").unwrap().values;
    // Exact sums do not depend on the order of their parts, so one word speaks for a thousand rows.
    let script = "import sys, math; print(math.fsum(map(float, sys.argv[1].split())).hex())";
    let values: Vec<String> = ours.iter().take(1000).map(|value| format!("{value:?}")).collect();
    let output = run(&python, &["-c".as_ref(), script.as_ref(), values.join(" ").as_ref()]);
    assert_eq!(sum, String::from_utf8(output.stdout).unwrap());
}

#[test]
fn a_log_written_by_h5py_is_read() {
    let Some(python) = python(&MODULES) else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.h5");
    let script = "import sys, h5py, numpy
log = h5py.File(sys.argv[1], 'w')
log.attrs['format'] = 'valve-log'
log.attrs['format_version'] = 1
log.attrs['title'] = numpy.bytes_('rig')
run = log.create_group('runs/one')
run.attrs['kind'] = 'dwell'
run.attrs['pressure_pa'] = 5e6
for name, unit in [('time', 's'), ('angle', 'rad'), ('torque', 'N*m')]:
    column = run.create_dataset(name, data=numpy.arange(5.0), compression='gzip')
    column.attrs['unit'] = unit
run['photo'] = numpy.zeros((3, 3))
log.close()";
    run(&python, &["-c".as_ref(), script.as_ref(), path.as_ref()]);
    let log = read_log(&path).unwrap();
    assert_eq!((log.title.as_str(), log.runs[0].kind.as_str()), ("rig", "dwell"));
    assert_eq!(log.runs[0].torque_nm.as_deref(), Some(&[0.0, 1.0, 2.0, 3.0, 4.0][..]));
    assert_eq!(log.runs[0].attributes["pressure_pa"], log_data::Attribute::Number(5e6));
}

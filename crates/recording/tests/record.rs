//! A whole record: every bit comes back, what is missing is known, and errors are values.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::*;
use proptest::prelude::*;
use recording::*;
use signals::{Feedback, Source};
use std::fs::{File, OpenOptions};
use std::path::Path;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn every_bit_comes_back_in_order(seed: u64, cycles in 0_u64..300, flush_every in 1_u64..50) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("REC-0001.mcap");
        let written = record(&path, seed, cycles, flush_every);
        let (read, report) = read(&[&path]);
        prop_assert!(read == written);
        prop_assert_eq!(&report.info, &info());
        prop_assert_eq!(&report.segments[0].damage, &vec![]);
        prop_assert_eq!((report.missed(), report.recorded()), (0, written.len() as u64));
        prop_assert!(report.refused.is_empty() && report.unreadable == 0);
    }
}

#[test]
fn two_lockstep_records_are_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    record(&a, 7, 100, 20);
    record(&b, 7, 100, 20);
    assert!(std::fs::read(a).unwrap() == std::fs::read(b).unwrap());
}

#[test]
fn recorded_and_missing_make_up_what_was_published() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("REC-0001.mcap");
    let mut dice = Dice(1);
    let mut writer = Writer::create(&path, &info()).unwrap();
    let lost = |k: &u64| (10..15).contains(k) || (20..22).contains(k) || *k == 99;
    for k in (0..100).filter(|k| !lost(k)) {
        writer.write(Source::Plant, &dice.message::<Feedback>(Source::Plant, k, k)).unwrap();
    }
    let gap = |first_missing, missed| Gap { topic: Topic::Feedback, generation: 0, first_missing, missed };
    writer.note_gap(&gap(10, 3)).unwrap();
    writer.note_gap(&gap(13, 2)).unwrap();
    writer.note_gap(&gap(99, 1)).unwrap();
    writer.note("the disk was slow").unwrap();
    writer.finish().unwrap();

    // A gap has no time of its own: it stands where the newest message stood, so that no clock is asked.
    let bytes = std::fs::read(&path).unwrap();
    let all = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let times: Vec<u64> = all.filter(|m| m.channel.topic == "/recorder/gaps").map(|m| m.log_time).collect();
    assert_eq!(times, [98 * PERIOD_NS; 3]);

    let (_, report) = read(&[&path]);
    let tally = report.tallies[&(Topic::Feedback, 0)];
    assert_eq!(tally, Tally { recorded: 92, missed: 8, repeated: 0 });
    let known = |gap, origin| KnownGap { gap, origin };
    assert_eq!(
        report.gaps,
        [
            known(gap(10, 3), GapOrigin::Declared),
            known(gap(13, 2), GapOrigin::Declared),
            known(gap(20, 2), GapOrigin::Undeclared),
            known(gap(99, 1), GapOrigin::Declared),
        ]
    );
    assert_eq!(report.notes, [Note { text: "the disk was slow".to_owned(), after: Some((0, 98)) }]);
}

#[test]
fn segments_form_one_record() {
    let folder = tempfile::tempdir().unwrap();
    let paths = [folder.path().join("REC-0001.mcap"), folder.path().join("REC-0002.mcap")];
    let mut dice = Dice(2);
    let mut feedback = |k| dice.message::<Feedback>(Source::Plant, k, k);
    let mut first = Writer::create(&paths[0], &info()).unwrap();
    (0..50).for_each(|k| first.write(Source::Plant, &feedback(k)).unwrap());
    first.flush().unwrap();
    let killed = std::fs::read(&paths[0]).unwrap();
    drop(first);
    std::fs::write(&paths[0], killed).unwrap();
    // A restarted recorder gets the newest message once more, or finds later ones.
    let mut second = Writer::create(&paths[1], &info()).unwrap();
    (49..51).chain(60..70).for_each(|k| second.write(Source::Plant, &feedback(k)).unwrap());
    second.finish().unwrap();

    let mut cycles = Vec::new();
    let report = read_record(&paths, |message| cycles.push(message.header().cycle)).unwrap();
    assert_eq!(cycles, (0..51).chain(60..70).collect::<Vec<u64>>());
    assert_eq!(report.tallies[&(Topic::Feedback, 0)], Tally { recorded: 61, missed: 9, repeated: 1 });
    assert!(matches!(report.segments[0].damage[..], [Damage::Unfinished { .. }]));
    assert_eq!(report.segments[1].damage, []);
}

#[test]
fn a_gap_between_segments_is_told_from_an_undeclared_one() {
    let folder = tempfile::tempdir().unwrap();
    let paths = [folder.path().join("REC-0001.mcap"), folder.path().join("REC-0002.mcap")];
    let mut dice = Dice(3);
    for (path, cycles) in [(&paths[0], 0..10), (&paths[1], 15..20)] {
        let mut writer = Writer::create(path, &info()).unwrap();
        for k in cycles {
            writer.write(Source::Plant, &dice.message::<Feedback>(Source::Plant, k, k)).unwrap();
        }
        writer.finish().unwrap();
    }
    let (_, report) = read(&[&paths[0], &paths[1]]);
    let gap = Gap { topic: Topic::Feedback, generation: 0, first_missing: 10, missed: 5 };
    assert_eq!(report.gaps, [KnownGap { gap, origin: GapOrigin::BetweenSegments }]);
}

#[test]
fn segments_of_different_records_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let paths = [folder.path().join("a.mcap"), folder.path().join("b.mcap")];
    Writer::create(&paths[0], &info()).unwrap().finish().unwrap();
    let other = RecordInfo { period_ns: 250_000, ..info() };
    Writer::create(&paths[1], &other).unwrap().finish().unwrap();
    let error = read_record(&paths, |_| {}).unwrap_err();
    assert!(
        error.to_string().contains("its period_ns is 250000, the segment's before it is 1000000"),
        "{error}"
    );
    let starts = [folder.path().join("c.mcap"), folder.path().join("d.mcap")];
    for (path, offset) in starts.iter().zip([7, 8]) {
        let start = RecordInfo { unix_offset_ns: Some(offset), ..info() };
        Writer::create(path, &start).unwrap().finish().unwrap();
    }
    let error = read_record(&starts, |_| {}).unwrap_err();
    assert!(error.to_string().contains("its start is another"), "{error}");
    assert!(matches!(read_record::<&Path>(&[], |_| {}), Err(RecordingError::NoSegment)));
}

#[test]
fn a_record_is_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("REC-0001.mcap");
    record(&path, 1, 3, 1);
    assert!(matches!(Writer::create(&path, &info()), Err(RecordingError::Create { .. })));
    assert_eq!(read(&[&path]).0.len(), 24);
}

#[test]
fn a_full_disk_is_an_error_and_no_panic() {
    let full = || OpenOptions::new().write(true).open("/dev/full").unwrap();
    let error = Writer::to_file(full(), Path::new("/dev/full"), &info()).err().unwrap();
    assert!(error.to_string().contains("No space left on device"), "{error}");
}

/// The disk fills up in the middle: a file size limit stands for it, set with `ulimit` in a child shell.
#[test]
fn what_was_flushed_before_the_disk_filled_up_can_be_read() {
    const LIMITED: &str = "STEPVALVE_TEST_LIMITED";
    if let Some(path) = std::env::var_os(LIMITED) {
        return fill_up(Path::new(&path));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("REC-0001.mcap");
    // 128 kB; without SIGXFSZ the write past it fails with EFBIG, as on a full disk.
    let status = std::process::Command::new("bash")
        .args(["-c", "trap '' XFSZ; ulimit -f 128; exec \"$0\" --exact \"$1\""])
        .arg(std::env::current_exe().unwrap())
        .arg("what_was_flushed_before_the_disk_filled_up_can_be_read")
        .env(LIMITED, &path)
        .stdout(std::process::Stdio::null())
        .status()
        .unwrap();
    assert!(status.success(), "the writer panicked on a full disk");
    let (messages, report) = read(&[&path]);
    assert!(messages.len() > 100, "{}", messages.len());
    assert!(!report.segments[0].damage.is_empty());
    assert_eq!(report.missed(), 0);
}

fn fill_up(path: &Path) {
    let mut dice = Dice(5);
    let mut writer = Writer::create(path, &info()).unwrap();
    for k in 0..10_000 {
        let message = dice.message::<Feedback>(Source::Plant, k, k);
        let written = writer.write(Source::Plant, &message).and_then(|()| writer.flush());
        if let Err(error) = written {
            assert!(matches!(error, RecordingError::Write { .. }), "{error}");
            // Going on must not panic either, nor dropping.
            let _ = writer.write(Source::Plant, &message);
            let _ = writer.flush();
            return;
        }
    }
    panic!("the disk never filled up");
}

#[test]
fn a_message_under_a_wrong_name_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = Writer::create(&folder.path().join("a.mcap"), &info()).unwrap();
    let message = Dice(1).message::<Feedback>(Source::Plant, 0, 0);
    let error = writer.write(Source::Controller, &message).unwrap_err();
    assert_eq!(error.to_string(), "Feedback is not published by the step-controller");
}

#[test]
fn a_message_that_fails_its_check_is_counted_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut writer = Writer::create(&path, &info()).unwrap();
    let mut dice = Dice(4);
    for k in 0..3 {
        let mut message = dice.message::<Feedback>(Source::Plant, k, k);
        if k == 1 {
            message.body.angle_rad += 1.0;
        }
        writer.write(Source::Plant, &message).unwrap();
    }
    writer.finish().unwrap();
    let (messages, report) = read(&[&path]);
    assert_eq!(messages.len(), 2);
    assert_eq!(report.refused[&Topic::Feedback], 1);
    assert_eq!(report.tallies[&(Topic::Feedback, 0)].missed, 1);
}

#[test]
fn files_of_other_kinds_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    assert!(matches!(read_info(&path), Err(RecordingError::Read { .. })));
    std::fs::write(&path, b"time,angle\n0,0\n").unwrap();
    assert!(matches!(read_info(&path), Err(RecordingError::NotMcap { .. })));
    let foreign = mcap::Writer::new(File::create(&path).unwrap()).unwrap().finish();
    assert!(foreign.is_ok());
    assert!(matches!(read_info(&path), Err(RecordingError::NotARecord { .. })));
}

/// Viewers show the wall's time; the loop's own stays beside it, and in each message's header.
#[test]
fn log_times_are_the_walls_and_publish_times_the_loops() {
    const OFFSET_NS: u64 = 1_790_000_000_000_000_000;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run-0001.mcap");
    let info = RecordInfo { unix_offset_ns: Some(OFFSET_NS), ..info() };
    let mut writer = Writer::create(&path, &info).unwrap();
    let mut dice = Dice(1);
    for k in 0..3 {
        writer.write(Source::Plant, &dice.message::<Feedback>(Source::Plant, k, k)).unwrap();
    }
    writer.finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let all = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let times: Vec<_> = all.map(|m| (m.log_time, m.publish_time)).collect();
    let expected: Vec<_> = (0..3).map(|k| (OFFSET_NS + k * PERIOD_NS, k * PERIOD_NS)).collect();
    assert_eq!(times, expected);
    assert_eq!(read(&[&path]).1.info, info);
}

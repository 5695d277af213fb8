//! The bus over real shared memory: cycles, losses, wrong generations, and nothing left behind.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use signal_bus::{Bus, Found, Place, RECORDER_DEPTH};
use signals::{Feedback, Header, LoopTiming, Message, Source};

fn place(name: &str) -> (tempfile::TempDir, Place) {
    let directory = tempfile::tempdir().unwrap();
    let place = Place {
        root: directory.path().join("generation"),
        prefix: format!("stepvalve_test_{name}_{}_", std::process::id()),
    };
    (directory, place)
}

fn feedback(angle_rad: f64) -> Feedback {
    Feedback { angle_rad, ..Feedback::default() }
}

#[test]
fn a_loop_reader_gets_the_message_of_its_cycle() {
    let (_directory, place) = place("cycle");
    let supervisor = Bus::create(&place, 5).unwrap();
    let plant = Bus::open(&place, 5).unwrap();
    let controller = Bus::open(&place, 5).unwrap();
    let mut writer = plant.writer::<Feedback>(Source::Plant).unwrap();
    let mut reader = controller.cycle_reader::<Feedback>(Source::Plant).unwrap();
    writer.connect();

    for file in place.shared_memory_files() {
        let mode = std::os::unix::fs::MetadataExt::mode(&std::fs::metadata(&file).unwrap());
        assert_eq!(mode & 0o077, 0, "others may use {}", file.display());
    }
    assert_eq!(reader.of_cycle(0), Found::NotYet, "nothing was published");
    for cycle in 0..4 {
        writer.write(cycle, cycle * 1_000_000, feedback(cycle as f64));
    }
    assert_eq!(reader.of_cycle(1).message().map(|f| f.angle_rad), Some(1.0), "cycle 0 is passed over");
    assert_eq!(reader.of_cycle(2).message().map(|f| f.angle_rad), Some(2.0));
    assert_eq!(reader.of_cycle(2), Found::NotYet, "a message is handed out once");
    assert_eq!(reader.of_cycle(3).message().map(|f| f.angle_rad), Some(3.0), "a later one was kept");
    assert_eq!(reader.missed(), 0);
    drop((writer, reader, plant, controller, supervisor));
    place.wipe().unwrap();
    assert!(place.shared_memory_files().is_empty() && !place.root.exists());
}

#[test]
fn a_reader_that_falls_behind_counts_what_it_lost() {
    let (_directory, place) = place("gaps");
    let bus = Bus::create(&place, 0).unwrap();
    let mut writer = bus.writer::<LoopTiming>(Source::Controller).unwrap();
    let mut slow = bus.stream_reader::<LoopTiming>(Source::Controller).unwrap();
    let mut looping = bus.cycle_reader::<LoopTiming>(Source::Controller).unwrap();
    slow.expect_from_start();
    writer.connect();
    let total = RECORDER_DEPTH as u64 + 1000;
    for cycle in 0..total {
        writer.write(cycle, 0, LoopTiming::default());
    }
    let mut received = 0;
    let mut lost = 0;
    while let Some((_, gap)) = slow.receive() {
        received += 1;
        lost += gap;
    }
    assert_eq!((received, lost), (RECORDER_DEPTH as u64, 1000));
    assert_eq!(received + lost, writer.published());
    assert_eq!(looping.latest().unwrap().header.cycle, total - 1);
    assert_eq!(writer.failures(), 0);
    drop((writer, slow, looping, bus));
    place.wipe().unwrap();
}

#[test]
fn another_generation_is_refused() {
    let (_directory, place) = place("generation");
    let old = Bus::create(&place, 1).unwrap();
    let new = Bus::open(&place, 2).unwrap();
    let mut writer = old.writer::<Feedback>(Source::Plant).unwrap();
    let mut reader = new.cycle_reader::<Feedback>(Source::Plant).unwrap();
    writer.connect();
    writer.write(0, 0, feedback(1.0));
    assert_eq!(reader.of_cycle(0), Found::NotYet);
    assert_eq!(reader.missed(), 1);
    drop((writer, reader, new, old));
    place.wipe().unwrap();
}

#[test]
fn a_second_publisher_is_refused() {
    let (_directory, place) = place("second");
    let bus = Bus::create(&place, 1).unwrap();
    let _writer = bus.writer::<Feedback>(Source::Plant).unwrap();
    assert!(bus.writer::<Feedback>(Source::Plant).is_err());
    drop((_writer, bus));
    place.wipe().unwrap();
}

#[test]
fn absence_is_said_and_kept_for_its_cycle() {
    let (_directory, place) = place("absence");
    let supervisor = Bus::create(&place, 0).unwrap();
    let plant = Bus::open(&place, 0).unwrap();
    let controller = Bus::open(&place, 0).unwrap();
    let mut writer = plant.writer::<Feedback>(Source::Plant).unwrap();
    let mut reader = controller.cycle_reader::<Feedback>(Source::Plant).unwrap();
    writer.connect();
    let message = writer.seal(0, 0, feedback(0.0));
    // From another start: nobody of ours has said so.
    writer.send(Message::absent(Header { generation: 9, ..message.header }));
    assert_eq!(reader.of_cycle(0), Found::NotYet);
    writer.send(Message::absent(message.header));
    writer.write(1, 0, feedback(1.0));
    assert_eq!(reader.of_cycle(0), Found::Absence);
    assert_eq!(reader.of_cycle(0), Found::NotYet, "it is said once");
    assert_eq!(reader.of_cycle(1).message().map(|f| f.angle_rad), Some(1.0));
    drop((writer, reader, plant, controller, supervisor));
    place.wipe().unwrap();
}

/// Without a clock a reader would wait for ever for another one.
#[test]
fn a_value_outside_its_rules_is_an_absence() {
    let (_directory, place) = place("rules");
    let bus = Bus::create(&place, 0).unwrap();
    let mut writer = bus.writer::<Feedback>(Source::Plant).unwrap();
    let mut reader = bus.cycle_reader::<Feedback>(Source::Plant).unwrap();
    writer.connect();
    writer.write(0, 0, feedback(f64::NAN));
    writer.write(1, 0, feedback(1.0));
    assert_eq!(reader.of_cycle(0), Found::Absence);
    assert!(matches!(reader.last_defect(), Some(signals::Defect::OutOfRange { field: "angle_rad", .. })));
    assert_eq!(reader.of_cycle(1).message().map(|f| f.angle_rad), Some(1.0));
    assert_eq!(reader.missed(), 1);
    drop((writer, reader, bus));
    place.wipe().unwrap();
}

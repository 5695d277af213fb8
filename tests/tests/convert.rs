//! `stepvalve convert` of a record that ends anywhere: what was flushed before the cut is in the run file, and the rest is
//! told. The seed of the cuts is printed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use injection::SplitSeed;
use recording::{AnyMessage, read_record};
use std::path::Path;
use stepvalve_tests::{Finished, TestPlace};

/// Random cuts, beside those around the record's ends.
const CUTS: u64 = 40;

/// Messages that the command says it has put into the run file.
fn messages(converted: &Finished) -> u64 {
    let said = converted.stdout.rsplit_once(" messages").expect("a count").0;
    said.rsplit(' ').next().unwrap().parse().unwrap()
}

fn convert(place: &TestPlace, record: &Path, out: &Path) -> Finished {
    place.stepvalve(&["convert", record.to_str().unwrap(), "--out", out.to_str().unwrap()])
}

#[test]
fn a_record_cut_anywhere_is_converted_as_far_as_it_goes() {
    let place = TestPlace::new();
    let scenario = place.shortened("step-sequence.toml", 3.0, &[]);
    place.simulate(&scenario, "lockstep", "out").expect_code(0);
    let bytes = std::fs::read(place.path("out/run-0001.mcap")).unwrap();
    let length = bytes.len() as u64;
    let seed = u64::from(crc32c::crc32c(&bytes));
    println!("cuts from seed {seed}");
    let mut details = SplitSeed::new(seed);
    let mut cuts: Vec<u64> = (0..CUTS).map(|_| details.whole(0, length)).collect();
    cuts.extend([0, 1, 7, 8, 9, length - 9, length - 8, length - 1, length]);
    cuts.sort_unstable();
    let whole = convert(&place, &place.path("out/run-0001.mcap"), &place.path("whole.h5")).expect_code(0);
    let all = messages(&whole);
    let (mut before, mut recovered) = (0, 0);
    for at in cuts {
        let (cut, out) = (place.path("cut.mcap"), place.path("cut.h5"));
        std::fs::write(&cut, &bytes[..at as usize]).unwrap();
        let (mut whole, mut cycles) = (0, 0);
        let readable = read_record(&[&cut], |message| {
            whole += 1;
            cycles += u64::from(matches!(message, AnyMessage::Feedback(_)));
        });
        let converted = convert(&place, &cut, &out);
        // A run file is a table of cycles; without one there is nothing to write.
        if readable.is_err() || cycles == 0 {
            assert!(converted.expect_code(2).stderr.contains("cut.mcap"), "cut at {at}");
            assert!(!out.exists(), "cut at {at}: a run file was begun");
            continue;
        }
        let converted = converted.expect_code(0);
        let count = messages(&converted);
        assert_eq!(count, whole, "cut at {at}");
        assert!(count >= before, "cut at {at}: fewer messages than a shorter file has");
        if count < all {
            assert!(converted.stderr.contains("cut.mcap"), "cut at {at}: nothing is said of it");
        }
        (before, recovered) = (count, recovered + 1);
        std::fs::remove_file(out).unwrap();
    }
    println!("{recovered} cut files converted");
    assert!(recovered > CUTS / 4, "only {recovered} of the cut files could be converted");
    assert_eq!(before, all);
}

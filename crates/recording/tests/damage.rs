//! Cut and damaged files: all that is whole is read, what is lost is told, and nothing panics.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

mod common;

use common::*;
use proptest::prelude::*;
use recording::*;
use std::path::Path;

/// A file cut at `length` bytes: what is read, or the error.
fn read_cut(path: &Path, bytes: &[u8]) -> Result<(Vec<AnyMessage>, Report), RecordingError> {
    std::fs::write(path, bytes).unwrap();
    let mut messages = Vec::new();
    let report = read_record(&[path], |message| messages.push(*message))?;
    Ok((messages, report))
}

/// A record, with the length of the file after each flush and the number of messages flushed by then.
fn flushed(path: &Path, seed: u64, cycles: u64) -> (Vec<AnyMessage>, Vec<(usize, usize)>) {
    let mut dice = Dice(seed);
    let mut writer = Writer::create(path, &info()).unwrap();
    let mut all = Vec::new();
    let mut flushes = vec![(writer.bytes_written() as usize, 0)];
    for k in 0..cycles {
        for message in cycle_messages(&mut dice, k) {
            write(&mut writer, &message);
            all.push(message);
        }
        writer.flush().unwrap();
        flushes.push((writer.bytes_written() as usize, all.len()));
    }
    writer.finish().unwrap();
    (all, flushes)
}

#[test]
fn cut_at_every_byte_all_flushed_messages_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let (path, cut) = (folder.path().join("a.mcap"), folder.path().join("cut.mcap"));
    let (all, flushes) = flushed(&path, 11, 4);
    let bytes = std::fs::read(path).unwrap();
    let data_end = flushes.last().unwrap().0;
    for length in 0..bytes.len() {
        let flushed = flushes.iter().rfind(|(at, _)| *at <= length);
        match (read_cut(&cut, &bytes[..length]), flushed) {
            // Cut inside what the file says about itself: no record, said plainly.
            (Err(RecordingError::NotARecord { .. }), None) => {}
            (Ok((messages, report)), flushed) => {
                let at_least = flushed.map_or(0, |(_, count)| *count);
                assert!(messages.len() >= at_least, "cut at {length}: {} < {at_least}", messages.len());
                assert!(messages == all[..messages.len()], "cut at {length}: not a prefix");
                let told = !report.segments[0].damage.is_empty();
                assert_eq!(told, length < data_end + 13, "cut at {length}: {:?}", report.segments[0].damage);
            }
            (Err(error), _) => panic!("cut at {length}: {error}"),
        }
    }
}

#[test]
fn a_cut_file_says_where_it_ends() {
    let folder = tempfile::tempdir().unwrap();
    let (path, cut) = (folder.path().join("a.mcap"), folder.path().join("cut.mcap"));
    let (_, flushes) = flushed(&path, 12, 3);
    let bytes = std::fs::read(path).unwrap();
    let at = flushes[2].0;
    let damage = |length: usize| read_cut(&cut, &bytes[..length]).unwrap().1.segments.remove(0).damage;
    assert_eq!(damage(at), [Damage::Unfinished { at_byte: at as u64 }]);
    assert_eq!(damage(at + 5), [Damage::Cut { at_byte: at as u64 }]);
    // After a loss of power the last blocks may hold zeros.
    let mut zeros = bytes[..at].to_vec();
    zeros.resize(at + 4096, 0);
    let (messages, report) = read_cut(&cut, &zeros).unwrap();
    assert_eq!(messages.len(), flushes[2].1);
    assert_eq!(report.segments[0].damage, [Damage::Garbled { at_byte: at as u64, what: "zeros".into() }]);
}

#[test]
fn a_damaged_chunk_costs_that_chunk_alone() {
    let folder = tempfile::tempdir().unwrap();
    let (path, bad) = (folder.path().join("a.mcap"), folder.path().join("bad.mcap"));
    let (all, flushes) = flushed(&path, 13, 10);
    let mut bytes = std::fs::read(path).unwrap();
    bytes[flushes[4].0 + 300] ^= 1;
    let (messages, report) = read_cut(&bad, &bytes).unwrap();
    let expected: Vec<_> = all[..flushes[4].1].iter().chain(&all[flushes[5].1..]).copied().collect();
    assert!(messages == expected);
    assert!(matches!(report.segments[0].damage[..], [Damage::Chunk { .. }, Damage::DataSection]));
    assert_eq!(report.missed(), 8);
    assert!(report.gaps.iter().all(|known| known.origin == GapOrigin::Undeclared));
}

/// One byte makes the end of the data of a chunk.
#[test]
fn a_chunk_that_became_an_end_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (path, bad) = (folder.path().join("a.mcap"), folder.path().join("bad.mcap"));
    let (all, flushes) = flushed(&path, 14, 6);
    let mut bytes = std::fs::read(path).unwrap();
    let (at, before) = flushes[2];
    assert_eq!(bytes[at], mcap::records::op::CHUNK);
    bytes[at] = mcap::records::op::DATA_END;
    // No CRC was taken, says such an end whose first four bytes are zero; with any other the CRC tells.
    bytes[at + 9..at + 13].fill(0);
    let (messages, report) = read_cut(&bad, &bytes).unwrap();
    assert!(messages == all[..before]);
    let at = at as u64;
    assert!(matches!(&report.segments[0].damage[..], [Damage::Garbled { at_byte, .. }] if *at_byte == at));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Some bytes change anywhere in the file.
    #[test]
    fn changed_bytes_never_give_changed_messages(
        seed: u64,
        changes in prop::collection::vec((any::<prop::sample::Index>(), 1_u8..), 1..4),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let (path, bad) = (folder.path().join("a.mcap"), folder.path().join("bad.mcap"));
        let (all, _) = flushed(&path, seed, 6);
        let mut bytes = std::fs::read(path).unwrap();
        for (index, change) in changes {
            let at = index.index(bytes.len());
            bytes[at] ^= change;
        }
        if let Ok((messages, report)) = read_cut(&bad, &bytes) {
            let mut rest = all.iter();
            prop_assert!(messages.iter().all(|message| rest.any(|original| original == message)));
            if messages.len() < all.len() {
                prop_assert!(!report.segments[0].damage.is_empty());
            }
        }
    }

    /// Any bytes at all behind the magic number.
    #[test]
    fn noise_never_panics(noise in prop::collection::vec(any::<u8>(), 0..400)) {
        let folder = tempfile::tempdir().unwrap();
        let bytes = [mcap::MAGIC, &noise[..]].concat();
        prop_assert!(read_cut(&folder.path().join("noise.mcap"), &bytes).is_err());
    }
}

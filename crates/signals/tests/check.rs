//! The message check, tried from outside: whatever is changed in a sealed message, it is refused by name.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use proptest::prelude::*;
use signals::*;

const EXPECTED: Expectation = Expectation { source: Source::Plant, generation: 7 };

fn sealed(body: Feedback) -> Message<Feedback> {
    Message::seal(Header::new::<Feedback>(Source::Plant, 7, 3, 5, 5_000_000), body)
}

fn example() -> Feedback {
    Feedback {
        angle_rad: 0.25,
        accepted_microsteps: -4476,
        encoder_counts: -5215,
        validity: 3,
        ..Feedback::default()
    }
}

#[test]
fn a_good_message_passes_and_survives_its_bytes() {
    let message = sealed(example());
    assert_eq!(check(&message, &EXPECTED), Ok(()));
    let mut bytes = Vec::new();
    message.append_bytes(&mut bytes);
    assert_eq!(
        bytes.len(),
        size_of::<Message<Feedback>>(),
        "no padding: bytes and memory are the same layout"
    );
    assert_eq!(Message::from_bytes(&bytes), Some(message));
    assert_eq!(Message::<Feedback>::from_bytes(&bytes[1..]), None);
}

#[test]
fn every_kind_of_defect_is_named() {
    let good = sealed(example());
    let with = |change: fn(&mut Header)| {
        let mut header = good.header;
        change(&mut header);
        Message::seal(header, good.body)
    };
    assert!(matches!(check(&with(|h| h.schema_hash ^= 1), &EXPECTED), Err(Defect::WrongSchema { .. })));
    assert!(matches!(
        check(&with(|h| h.source = 2), &EXPECTED),
        Err(Defect::WrongSource { found: 2, expected: 3 })
    ));
    assert!(matches!(
        check(&with(|h| h.generation = 6), &EXPECTED),
        Err(Defect::WrongGeneration { found: 6, expected: 7 })
    ));
    let absent = Message::<Feedback>::absent(good.header);
    assert_eq!(check(&absent, &EXPECTED), Err(Defect::Absent { cycle: 5 }));
    let other = Message::<Feedback>::absent(Header { generation: 6, ..good.header });
    assert!(
        matches!(check(&other, &EXPECTED), Err(Defect::WrongGeneration { .. })),
        "absence is said by us alone"
    );
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
        let defect = check(&sealed(Feedback { angle_rad: bad, ..example() }), &EXPECTED).unwrap_err();
        assert!(matches!(defect, Defect::OutOfRange { field: "angle_rad", .. }), "{defect}");
    }
    let defect = check(&sealed(Feedback { validity: u64::MAX, ..example() }), &EXPECTED).unwrap_err();
    assert!(matches!(defect, Defect::OutOfRange { field: "validity", .. }), "{defect}");
}

proptest! {
    /// CRC-32C finds every burst of up to 32 bits and any few flipped bits in messages this short.
    #[test]
    fn flipped_bits_never_pass(bits in prop::collection::btree_set(0_usize..Message::<Feedback>::WORDS * 64, 1..=5)) {
        let mut bytes = Vec::new();
        sealed(example()).append_bytes(&mut bytes);
        for bit in bits {
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        let damaged = Message::<Feedback>::from_bytes(&bytes).unwrap();
        prop_assert!(check(&damaged, &EXPECTED).is_err());
    }

    /// However a publisher's messages arrive, received + missed = the newest number + 1 when counted from the start.
    #[test]
    fn gaps_are_counted_exactly(steps in prop::collection::vec(0_u64..5, 1..200)) {
        let mut tracker = SequenceTracker::from_start();
        let mut sequence = 0;
        for step in steps {
            sequence += step;
            tracker.note(sequence);
        }
        prop_assert_eq!(tracker.received() + tracker.missed(), sequence + 1);
    }
}

proptest! {
    /// What was within its rules stays bit for bit; no number stays beyond them, not even NaN.
    #[test]
    fn a_clamped_body_has_no_number_that_a_reader_refuses(words in prop::collection::vec(any::<u64>(), ControlStatus::FIELDS.len())) {
        let body = ControlStatus::from_words(words.iter().copied());
        let clamped = body.clamped();
        let (mut before, mut after) = (Vec::new(), Vec::new());
        body.each_word(|word| before.push(word));
        clamped.each_word(|word| after.push(word));
        for ((field, before), after) in ControlStatus::FIELDS.iter().zip(before).zip(after) {
            let value = field.kind.value(after);
            match field.rule {
                Rule::Within(low, high) => {
                    prop_assert!(low <= value && value <= high, "{}: {}", field.name, value);
                    let kept = field.kind.value(before);
                    prop_assert!(!(low <= kept && kept <= high) || before == after, "{}", field.name);
                }
                _ => prop_assert_eq!(before, after, "{}", field.name),
            }
        }
    }
}

/// The layout is a contract with recordings and with other builds: a change here must be meant.
#[test]
fn schema_hashes_differ_between_messages() {
    let hashes = [
        Reference::SCHEMA_HASH,
        StepCommand::SCHEMA_HASH,
        Feedback::SCHEMA_HASH,
        ControlStatus::SCHEMA_HASH,
        ControllerSnapshot::SCHEMA_HASH,
        PlantTruth::SCHEMA_HASH,
        BusStatus::SCHEMA_HASH,
        LoopTiming::SCHEMA_HASH,
        SetPoint::SCHEMA_HASH,
        OperatorCommand::SCHEMA_HASH,
        RecorderProgress::SCHEMA_HASH,
    ];
    let unique: std::collections::BTreeSet<_> = hashes.iter().collect();
    assert_eq!(unique.len(), hashes.len());
}

#[test]
fn old_and_repeated_messages_are_told_apart() {
    let mut tracker = SequenceTracker::default();
    assert_eq!(tracker.note(10), Arrival::Next);
    assert_eq!(tracker.note(10), Arrival::Repeated);
    assert_eq!(tracker.note(13), Arrival::Gap(2));
    assert_eq!(tracker.note(11), Arrival::Old);
    assert_eq!((tracker.received(), tracker.missed(), tracker.expected()), (2, 2, Some(14)));
}

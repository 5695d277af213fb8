//! What befalls messages on a line, and the text form of faults.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use injection::{Damage, Fault, Injection, Line, SplitSeed, Stream, draw};
use signals::{Body, Expectation, Feedback, Header, Message, Source, check};

/// Not the usual 131,072.
const COUNTS_PER_TURN: f64 = 4000.0;

const EXPECTED: Expectation = Expectation { source: Source::Plant, generation: 4 };

fn sealed(cycle: u64) -> Message<Feedback> {
    let header = Header::new::<Feedback>(Source::Plant, 4, cycle, cycle, cycle * 1000);
    Message::seal(header, Feedback { angle_rad: cycle as f64 * 1e-3, ..Feedback::default() })
}

/// Sequence numbers of what comes out that passes the check, cycle by cycle.
fn passes(fault: &str, cycles: u64) -> Vec<Vec<u64>> {
    let mut line = Line::new(Some(COUNTS_PER_TURN));
    line.add(&Injection::parse(fault).unwrap());
    (0..cycles)
        .map(|cycle| {
            let carried = line.carry(cycle, sealed(cycle));
            let good = carried.messages.into_iter().flatten().filter(|m| check(m, &EXPECTED).is_ok());
            let good: Vec<_> = good.map(|message| message.header.sequence).collect();
            assert_eq!(good.contains(&cycle), carried.arrives, "cycle {cycle}: {good:?}");
            good
        })
        .collect()
}

#[test]
fn messages_are_lost_doubled_late_and_replayed() {
    assert_eq!(passes("drop feedback at=1 count=2", 4), [vec![0], vec![], vec![], vec![3]]);
    assert_eq!(passes("duplicate feedback at=1", 3), [vec![0], vec![1, 1], vec![2]]);
    assert_eq!(passes("delay feedback at=1", 4), [vec![0], vec![], vec![2, 1], vec![3]]);
    assert_eq!(passes("replay feedback at=2 age=2", 4), [vec![0], vec![1], vec![0], vec![3]]);
    assert_eq!(passes("drop reference at=0 count=all", 2), [vec![0], vec![1]]);
}

#[test]
fn damaged_messages_are_refused() {
    for fault in [
        "flip-bits feedback bits=3 seed=9",
        "wrong-schema feedback",
        "wrong-generation feedback",
        "wrong-source feedback",
        "field feedback name=angle_rad value=nan",
        "field feedback name=validity value=0xffffffffffffffff",
        "field feedback name=oil_temperature_c value=-300",
    ] {
        assert_eq!(passes(&format!("{fault} at=1"), 3), [vec![0], vec![], vec![2]], "{fault}");
    }
}

#[test]
fn the_encoder_freezes_and_jumps() {
    let angles = |fault: &str| -> Vec<f64> {
        let mut line = Line::new(Some(COUNTS_PER_TURN));
        line.add(&Injection::parse(fault).unwrap());
        let angle = |cycle| line.carry(cycle, sealed(cycle)).messages[0].unwrap().body.angle_rad;
        (0..5).map(angle).collect()
    };
    assert_eq!(angles("frozen-encoder at=2 count=2"), [0.0, 0.001, 0.002, 0.002, 0.004]);
    assert_eq!(angles("encoder-jump at=3 by_rad=1"), [0.0, 0.001, 0.002, 1.003, 1.004]);
}

#[test]
fn an_encoder_that_has_jumped_can_jump_again_and_other_faults_befall_it() {
    let mut line = Line::new(Some(COUNTS_PER_TURN));
    let faults = [
        "encoder-jump at=1 by_rad=1",
        "encoder-jump at=2 by_rad=1",
        "frozen-encoder at=3 count=all",
        "drop feedback at=4",
    ];
    faults.iter().for_each(|fault| line.add(&Injection::parse(fault).unwrap()));
    let angles: Vec<Option<f64>> = (0..6)
        .map(|cycle| line.carry(cycle, sealed(cycle)).messages[0].map(|message| message.body.angle_rad))
        .collect();
    assert_eq!(angles, [Some(0.0), Some(1.001), Some(2.002), Some(2.003), None, Some(2.003)]);
}

#[test]
fn counts_jump_as_far_as_the_angle_does() {
    let mut line = Line::new(Some(COUNTS_PER_TURN));
    line.add(&Injection::parse("encoder-jump by_rad=1").unwrap());
    let jumped = line.carry(0, sealed(0)).messages[0].unwrap().body;
    assert_eq!(jumped.encoder_counts, (COUNTS_PER_TURN / std::f64::consts::TAU).round() as i64);
}

#[test]
fn texts_say_what_is_wrong() {
    for (text, says) in [
        ("", "the name"),
        ("flip-bits", "the message"),
        ("flip-bits feedback bits=0", "1 to 64"),
        ("drop feedback count=x", "a whole number"),
        ("drop feedback now=1", "expected of this fault's at, count"),
        ("pause step-controller sec=1", "expected of this fault's at, ms"),
        ("kill somebody", "step-controller"),
        ("field feedback name=x", "encoder_counts"),
    ] {
        let error = Injection::parse(text).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
    let kill = Injection::parse("kill run-recorder").unwrap();
    assert_eq!(kill, Injection { at: 0, fault: Fault::Kill { process: Source::Recorder } });
}

#[test]
fn what_is_drawn_has_a_text_that_reads_back() {
    for seed in 0..2000 {
        let mut details = SplitSeed::new(seed);
        let name = details.one(
            &[
                "drop",
                "flip-bits",
                "delay",
                "replay",
                "field",
                "encoder-jump",
                "frozen-encoder",
                "overrun",
                "silence",
            ],
            "drop",
        );
        let injection = draw(name, 100 + seed, &mut details).unwrap();
        assert_eq!(
            Injection::parse(&injection.to_string()),
            Ok(injection.clone()),
            "seed {seed}: {injection}"
        );
        let sent = postcard::to_stdvec(&injection).unwrap();
        assert_eq!(postcard::from_bytes(&sent), Ok(injection), "seed {seed}");
    }
}

#[test]
fn every_field_of_every_message_is_drawn() {
    let mut seen = std::collections::BTreeSet::new();
    for seed in 0..5000 {
        if let Fault::Message { stream, damage: Damage::Field { index, .. }, .. } =
            draw("field", 1, &mut SplitSeed::new(seed)).unwrap().fault
        {
            seen.insert((stream, index));
        }
    }
    assert_eq!(seen.len(), Stream::ALL.iter().map(|stream| stream.fields().len()).sum::<usize>());
    assert!(Feedback::FIELDS.len() > 5);
}

//! What the fuzzer throws at stepvalve: each function takes any bytes at all, and may not panic.
#![forbid(unsafe_code)]

use config::{parse_model, parse_scenario};
use recording::read_record;
use signals::{
    Body, ControlStatus, Expectation, Feedback, LoopTiming, Message, OperatorCommand, PlantTruth,
    RecorderProgress, Reference, SetPoint, Source, StepCommand, check,
};
use std::io::Write;

/// A scenario or a model: refused with places, or accepted.
pub fn configuration(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    for error in
        [parse_scenario(text, "fuzz.toml").err(), parse_model(text, "fuzz.toml").err()].into_iter().flatten()
    {
        assert!(error.to_string().contains("fuzz.toml"), "an error without a place: {error}");
    }
}

/// A message of any kind: what passes the check is finite and in its range, and survives its bytes.
pub fn message_check(bytes: &[u8]) {
    each::<Reference>(bytes, Source::Trajectory);
    each::<StepCommand>(bytes, Source::Controller);
    each::<ControlStatus>(bytes, Source::Controller);
    each::<Feedback>(bytes, Source::Plant);
    each::<PlantTruth>(bytes, Source::Plant);
    each::<LoopTiming>(bytes, Source::Plant);
    each::<SetPoint>(bytes, Source::Supervisor);
    each::<OperatorCommand>(bytes, Source::Supervisor);
    each::<RecorderProgress>(bytes, Source::Recorder);
}

fn each<B: Body>(bytes: &[u8], source: Source) {
    let length = Message::<B>::WORDS * 8;
    let mut padded = bytes.to_vec();
    padded.resize(length, 0);
    let Some(raw) = Message::<B>::from_bytes(&padded) else { return };
    let expected = Expectation { source, generation: raw.header.generation };
    // As it is, and as a sender that computes nonsense would seal it.
    let mut header = raw.header;
    (header.schema_hash, header.source) = (B::SCHEMA_HASH, source.code());
    for message in [raw, Message::seal(header, raw.body)] {
        if check(&message, &expected).is_err() {
            continue;
        }
        let mut again = Vec::new();
        message.append_bytes(&mut again);
        let back = Message::<B>::from_bytes(&again);
        assert!(back.is_some_and(|back| check(&back, &expected).is_ok()));
        let mut fields = B::FIELDS.iter();
        message.body.each_word(|word| {
            if fields.next().is_some_and(|field| field.kind == signals::Kind::F64) {
                assert!(f64::from_bits(word).is_finite(), "a number that is none passed the check");
            }
        });
    }
}

/// A record, whole, cut or damaged: whatever can be read is read, the rest is told.
pub fn record_recovery(bytes: &[u8]) {
    let Ok(mut file) = tempfile::NamedTempFile::new() else { return };
    if file.write_all(bytes).is_err() {
        return;
    }
    let mut count = 0_u64;
    if let Ok(report) = read_record(&[file.path()], |_| count += 1) {
        assert_eq!(report.recorded(), count);
    }
}

//! Messages with arbitrary, valid contents, and records made of them.
#![allow(dead_code)]

use recording::{AnyMessage, RecordInfo, Texts, Writer};
use signals::*;
use std::path::Path;

pub const PERIOD_NS: u64 = 1_000_000;

/// A small generator of its own, so that a record depends on its seed alone.
pub struct Dice(pub u64);

impl Dice {
    pub fn roll(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn word(&mut self, field: &Field) -> u64 {
        let raw = self.roll();
        let part = raw as f64 / u64::MAX as f64;
        match (field.rule, field.kind) {
            (Rule::Any, Kind::F64) => part.to_bits(),
            (Rule::Any, _) => raw,
            (Rule::Below(limit), _) => raw % limit,
            (Rule::Within(low, high), Kind::F64) => (low + part * (high - low)).to_bits(),
            (Rule::Within(low, high), Kind::I64) => ((low + part * (high - low)) as i64).cast_unsigned(),
            (Rule::Within(_, high), Kind::U64) => raw % (high as u64),
        }
    }

    pub fn message<B: Body>(&mut self, source: Source, sequence: u64, cycle: u64) -> Message<B> {
        let words: Vec<u64> = B::FIELDS.iter().map(|field| self.word(field)).collect();
        let header = Header::new::<B>(source, 0, sequence, cycle, cycle * PERIOD_NS);
        Message::seal(header, B::from_words(words.into_iter()))
    }
}

pub fn info() -> RecordInfo {
    RecordInfo {
        title: "step sequence".into(),
        instance: "bench".into(),
        operated: false,
        mode: "lockstep".into(),
        program_version: "0.1.0".into(),
        generation: 0,
        period_ns: PERIOD_NS,
        microstep_rad: Some(0.1 + 0.2),
        started_unix_ns: None,
        unix_offset_ns: None,
        texts: Texts { scenario: "name = \"µ\"\n".into(), truth: "t".repeat(1000), belief: String::new() },
        machine: [("kernel".to_owned(), "6.18".to_owned())].into(),
    }
}

/// What one cycle publishes.
pub fn cycle_messages(dice: &mut Dice, k: u64) -> Vec<AnyMessage> {
    use Source::{Controller, Plant, Trajectory};
    vec![
        AnyMessage::Feedback(dice.message(Plant, k, k)),
        AnyMessage::PlantTruth(dice.message(Plant, k, k)),
        AnyMessage::LoopTiming(Plant, dice.message(Plant, k, k)),
        AnyMessage::Reference(dice.message(Trajectory, k, k + 2)),
        AnyMessage::LoopTiming(Trajectory, dice.message(Trajectory, k, k)),
        AnyMessage::StepCommand(dice.message(Controller, k, k + 1)),
        AnyMessage::ControlStatus(dice.message(Controller, k, k)),
        AnyMessage::LoopTiming(Controller, dice.message(Controller, k, k)),
    ]
}

pub fn write(writer: &mut Writer, message: &AnyMessage) {
    use Source::{Controller, Plant, Recorder, Supervisor, Trajectory};
    match message {
        AnyMessage::Reference(m) => writer.write(Trajectory, m),
        AnyMessage::StepCommand(m) => writer.write(Controller, m),
        AnyMessage::Feedback(m) => writer.write(Plant, m),
        AnyMessage::ControlStatus(m) => writer.write(Controller, m),
        AnyMessage::PlantTruth(m) => writer.write(Plant, m),
        AnyMessage::BusStatus(m) => writer.write(Plant, m),
        AnyMessage::SetPoint(m) => writer.write(Supervisor, m),
        AnyMessage::OperatorCommand(m) => writer.write(Supervisor, m),
        AnyMessage::RecorderProgress(m) => writer.write(Recorder, m),
        AnyMessage::ControllerSnapshot(m) => writer.write(Controller, m),
        AnyMessage::LoopTiming(source, m) => writer.write(*source, m),
    }
    .unwrap();
}

/// A finished record of some cycles, flushed every `flush_every`; returns its messages in order.
pub fn record(path: &Path, seed: u64, cycles: u64, flush_every: u64) -> Vec<AnyMessage> {
    let mut dice = Dice(seed);
    let mut writer = Writer::create(path, &info()).unwrap();
    let mut all = Vec::new();
    for k in 0..cycles {
        for message in cycle_messages(&mut dice, k) {
            write(&mut writer, &message);
            all.push(message);
        }
        if k % flush_every == flush_every - 1 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
    all
}

pub fn read(paths: &[&Path]) -> (Vec<AnyMessage>, recording::Report) {
    let mut messages = Vec::new();
    let report = recording::read_record(paths, |message| messages.push(*message)).unwrap();
    (messages, report)
}

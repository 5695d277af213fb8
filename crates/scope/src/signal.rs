//! The signals that can be looked at: each field of each message that the loop publishes every cycle.

use recording::{Codes, Topic, codes};
use serde::Serialize;
use serde::ser::SerializeStruct;
use signals::{Header, Kind};

/// Messages whose fields are looked at. Orders and set-points are no signals, they have no cycle of their own, and the
/// controller's snapshot is a part of its memory at a time. All of them are in captures.
const SHOWN: [Topic; 9] = [
    Topic::Feedback,
    Topic::Reference,
    Topic::ControlStatus,
    Topic::StepCommand,
    Topic::PlantTruth,
    Topic::BusStatus,
    Topic::TrajectoryTiming,
    Topic::ControllerTiming,
    Topic::PlantTiming,
];

/// Where a value is found in the messages of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Field {
    /// Eight-byte word behind the header.
    pub(crate) index: usize,
    kind: Which,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Which {
    U64,
    I64,
    F64,
}

impl Field {
    /// Its value in a message's bytes; counts above 2^53 are rounded. NaN where the message is too short.
    pub(crate) fn value(self, bytes: &[u8]) -> f64 {
        let words = bytes.as_chunks::<8>().0;
        let Some(word) = words.get(Header::FIELDS.len() + self.index) else { return f64::NAN };
        let word = u64::from_le_bytes(*word);
        match self.kind {
            Which::U64 => word as f64,
            Which::I64 => word.cast_signed() as f64,
            Which::F64 => f64::from_bits(word),
        }
    }
}

/// A signal.
#[derive(Debug, Clone)]
pub(crate) struct Signal {
    /// `feedback.angle_rad`: message and field.
    pub(crate) name: String,
    pub(crate) topic: Topic,
    pub(crate) field: Field,
    pub(crate) unit: &'static str,
    codes: Option<Codes>,
}

impl Serialize for Signal {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (flags, names) = match &self.codes {
            Some(Codes::Values(names)) => (false, names.as_slice()),
            Some(Codes::Flags(names)) => (true, names.as_slice()),
            None => (false, [].as_slice()),
        };
        let mut fields = serializer.serialize_struct("Signal", 6)?;
        fields.serialize_field("name", &self.name)?;
        fields.serialize_field("topic", &(self.topic as u32))?;
        fields.serialize_field("field", &self.field.index)?;
        fields.serialize_field("unit", self.unit)?;
        fields.serialize_field("flags", &flags)?;
        fields.serialize_field("codes", names)?;
        fields.end()
    }
}

/// All of them, message by message.
pub(crate) fn signals() -> Vec<Signal> {
    let of_topic = |topic: &Topic| {
        let topic = *topic;
        topic.body_fields().iter().enumerate().map(move |(index, field)| Signal {
            name: format!("{}.{}", topic.path().trim_start_matches('/').replace('/', "."), field.name),
            topic,
            field: Field { index, kind: which(field.kind) },
            unit: field.unit,
            codes: codes(topic, field.name),
        })
    };
    SHOWN.iter().flat_map(of_topic).collect()
}

fn which(kind: Kind) -> Which {
    match kind {
        Kind::U64 => Which::U64,
        Kind::I64 => Which::I64,
        Kind::F64 => Which::F64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use signals::{Body, Feedback, Message, Source};

    #[test]
    fn a_value_is_the_message_s() {
        let body = Feedback { angle_rad: 0.25, encoder_counts: -7, validity: 3, ..Feedback::default() };
        let message = Message::seal(Header::new::<Feedback>(Source::Plant, 1, 2, 3, 4), body);
        let mut bytes = Vec::new();
        message.append_bytes(&mut bytes);
        let all = signals();
        let value = |name: &str| all.iter().find(|signal| signal.name == name).unwrap().field.value(&bytes);
        assert_eq!(value("feedback.angle_rad"), 0.25);
        assert_eq!(value("feedback.encoder_counts"), -7.0);
        assert_eq!(value("feedback.validity"), 3.0);
        assert!(all.len() > Feedback::FIELDS.len());
    }
}

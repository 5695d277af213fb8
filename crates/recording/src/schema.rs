//! `ros2msg` schemas, made from the same field tables that lay out the messages.

use crate::Topic;
use crate::codes::codes;
use signals::{
    Body, BusStatus, ControlStatus, ControllerSnapshot, Feedback, Field, Header, Kind, LoopTiming,
    OperatorCommand, PlantTruth, RecorderProgress, Reference, SetPoint, StepCommand,
};

/// What a topic's payloads are, as `ros2msg` says it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schema {
    /// Its name.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// The schema of a topic's payloads, which are [`crate::CDR_HEADER`] and the message's bytes.
pub fn of_topic(topic: Topic) -> Schema {
    match topic {
        Topic::Reference => of_body::<Reference>(topic),
        Topic::StepCommand => of_body::<StepCommand>(topic),
        Topic::Feedback => of_body::<Feedback>(topic),
        Topic::ControlStatus => of_body::<ControlStatus>(topic),
        Topic::ControllerSnapshot => of_body::<ControllerSnapshot>(topic),
        Topic::PlantTruth => of_body::<PlantTruth>(topic),
        Topic::BusStatus => of_body::<BusStatus>(topic),
        Topic::SetPoint => of_body::<SetPoint>(topic),
        Topic::OperatorCommand => of_body::<OperatorCommand>(topic),
        Topic::RecorderProgress => of_body::<RecorderProgress>(topic),
        Topic::TrajectoryTiming | Topic::ControllerTiming | Topic::PlantTiming => {
            of_body::<LoopTiming>(topic)
        }
    }
}

/// The schema of declared gaps; [`crate::cdr::gap`] writes its payload.
pub(crate) fn of_gaps() -> Schema {
    named(
        "RecorderGap",
        "# Messages that never reached the recorder.\n\
         uint64 generation\nuint64 first_missing # sequence number\nuint64 missed # how many\nstring topic\n",
    )
}

/// The schema of the recorder's notes; [`crate::cdr::note`] writes its payload.
pub(crate) fn of_notes() -> Schema {
    named("RecorderNote", "# What happened to the recorder.\nstring text\n")
}

fn named(name: &str, text: &str) -> Schema {
    Schema { name: format!("stepvalve_msgs/msg/{name}"), text: text.to_owned() }
}

fn of_body<B: Body>(topic: Topic) -> Schema {
    let mut text = String::from("# Header\n");
    Header::FIELDS.iter().for_each(|field| text.push_str(&lines(topic, field)));
    text.push_str(&format!("# {}\n", B::NAME));
    B::FIELDS.iter().for_each(|field| text.push_str(&lines(topic, field)));
    named(B::NAME, &text)
}

/// A field, behind the constants that its numbers stand for: viewers then show names.
fn lines(topic: Topic, field: &Field) -> String {
    let mut text = String::new();
    let codes = codes(topic, field.name);
    for (code, name) in codes.iter().flat_map(|codes| codes.all()) {
        // Capitals, digits and single underscores alone: the format takes nothing else.
        let words = format!("{} {name}", field.name).to_ascii_uppercase();
        let words: Vec<_> =
            words.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty()).collect();
        let constant = words.join("_");
        text.push_str(&format!("uint64 {constant}={code}\n"));
    }
    text + &line(field)
}

fn line(field: &Field) -> String {
    let kind = match field.kind {
        Kind::U64 => "uint64",
        Kind::I64 => "int64",
        Kind::F64 => "float64",
    };
    match field.unit {
        "1" => format!("{kind} {}\n", field.name),
        unit => format!("{kind} {} # {unit}\n", field.name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schemas_name_every_field_once_with_its_unit() {
        for topic in Topic::ALL {
            let schema = of_topic(*topic);
            let fields = schema.text.lines().filter(|line| !line.contains('='));
            let mut names: Vec<_> = fields.filter_map(|line| line.split(' ').nth(1)).collect();
            let all = names.len();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), all, "a body field of {} hides a header field", schema.name);
        }
        let text = of_topic(Topic::Feedback).text;
        assert!(text.contains("\nuint64 monotonic_ns # ns\n"), "{text}");
        assert!(text.contains("\nint64 encoder_counts\n"), "{text}");
        assert!(text.contains("\nfloat64 angle_rad # rad\n"), "{text}");
        let text = of_topic(Topic::ControlStatus).text;
        assert!(text.contains("\nuint64 STATE_QUICK_STOP=2\n"), "{text}");
        assert!(text.contains("\nuint64 STATE_HOMING=5\nuint64 state\n"), "{text}");
    }
}

//! `ros2msg` schemas, made from the same field tables that lay out the messages.

use crate::Topic;
use signals::{
    Body, BusStatus, ControlStatus, ControllerSnapshot, Feedback, Field, Header, Kind, LoopTiming,
    OperatorCommand, PlantTruth, RecorderProgress, Reference, SetPoint, StepCommand,
};

/// Name and text of a schema.
pub(crate) struct Schema {
    pub(crate) name: String,
    pub(crate) text: String,
}

/// The schema of a topic's messages.
pub(crate) fn of_topic(topic: Topic) -> Schema {
    match topic {
        Topic::Reference => of_body::<Reference>(),
        Topic::StepCommand => of_body::<StepCommand>(),
        Topic::Feedback => of_body::<Feedback>(),
        Topic::ControlStatus => of_body::<ControlStatus>(),
        Topic::ControllerSnapshot => of_body::<ControllerSnapshot>(),
        Topic::PlantTruth => of_body::<PlantTruth>(),
        Topic::BusStatus => of_body::<BusStatus>(),
        Topic::SetPoint => of_body::<SetPoint>(),
        Topic::OperatorCommand => of_body::<OperatorCommand>(),
        Topic::RecorderProgress => of_body::<RecorderProgress>(),
        Topic::TrajectoryTiming | Topic::ControllerTiming | Topic::PlantTiming => of_body::<LoopTiming>(),
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

fn of_body<B: Body>() -> Schema {
    let mut text = String::from("# Header\n");
    Header::FIELDS.iter().for_each(|field| text.push_str(&line(field)));
    text.push_str(&format!("# {}\n", B::NAME));
    B::FIELDS.iter().for_each(|field| text.push_str(&line(field)));
    named(B::NAME, &text)
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
            let mut names: Vec<_> = schema.text.lines().filter_map(|line| line.split(' ').nth(1)).collect();
            let all = names.len();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), all, "a body field of {} hides a header field", schema.name);
        }
        let text = of_topic(Topic::Feedback).text;
        assert!(text.contains("\nuint64 monotonic_ns # ns\n"), "{text}");
        assert!(text.contains("\nint64 encoder_counts\n"), "{text}");
        assert!(text.contains("\nfloat64 angle_rad # rad\n"), "{text}");
    }
}

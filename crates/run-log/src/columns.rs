//! The messages whose fields are a run's columns.

use recording::Topic;
use signals::{
    Body, BusStatus, ControlStatus, Feedback, PlantTruth, RUN_COLUMNS, Reference, RunColumn, StepCommand,
};

/// The messages of a cycle: their topic on the bus, and in records.
const TOPICS: [(&str, Topic); 6] = [
    (Reference::TOPIC, Topic::Reference),
    (StepCommand::TOPIC, Topic::StepCommand),
    (Feedback::TOPIC, Topic::Feedback),
    (ControlStatus::TOPIC, Topic::ControlStatus),
    (PlantTruth::TOPIC, Topic::PlantTruth),
    (BusStatus::TOPIC, Topic::BusStatus),
];

/// The topics of a cycle's messages.
pub(crate) fn topics() -> impl Iterator<Item = Topic> {
    TOPICS.into_iter().map(|(_, topic)| topic)
}

/// The columns of a run in their order, each with the messages that carry it.
pub(crate) fn columns() -> impl Iterator<Item = (&'static RunColumn, Topic)> {
    RUN_COLUMNS.iter().filter_map(|column| {
        let (_, topic) = TOPICS.into_iter().find(|(name, _)| *name == column.topic)?;
        Some((column, topic))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_of_these_messages_and_take_no_channel_s_name() {
        assert_eq!(columns().count(), RUN_COLUMNS.len());
        for (column, topic) in columns() {
            assert!(topic.body_fields().iter().any(|field| field.name == column.field), "{column:?}");
            assert!(log_data::Channel::from_name(column.name).is_none(), "{column:?}");
        }
    }
}

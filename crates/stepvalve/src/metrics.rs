//! A run's metrics from its record.

use closed_loop::Metrics;
use recording::AnyMessage;

/// Takes note of a message.
pub fn note(metrics: &mut Metrics, message: &AnyMessage) {
    match message {
        AnyMessage::Reference(message) => metrics.reference(message.header.cycle, &message.body),
        AnyMessage::PlantTruth(message) => metrics.truth(message.header.cycle, &message.body),
        AnyMessage::ControlStatus(message) => metrics.status(message.header.cycle, &message.body),
        AnyMessage::StepCommand(message) => metrics.command(&message.body),
        AnyMessage::Feedback(message) => metrics.feedback(message.header.cycle, &message.body),
        _ => {}
    }
}

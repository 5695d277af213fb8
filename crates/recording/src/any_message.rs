//! A message of the loop as it comes out of a record.

use crate::{Topic, cdr};
use signals::{
    Body, BusStatus, ControlStatus, ControllerSnapshot, Expectation, Feedback, Header, LoopTiming, Message,
    OperatorCommand, PlantTruth, RecorderProgress, Reference, SetPoint, Source, StepCommand, check,
};

/// One message, by its type.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(missing_docs, reason = "each variant is the message of its name")]
pub enum AnyMessage {
    Reference(Message<Reference>),
    StepCommand(Message<StepCommand>),
    Feedback(Message<Feedback>),
    ControlStatus(Message<ControlStatus>),
    ControllerSnapshot(Message<ControllerSnapshot>),
    PlantTruth(Message<PlantTruth>),
    BusStatus(Message<BusStatus>),
    SetPoint(Message<SetPoint>),
    OperatorCommand(Message<OperatorCommand>),
    RecorderProgress(Message<RecorderProgress>),
    /// With the process whose timing it is.
    LoopTiming(Source, Message<LoopTiming>),
}

/// One expression for whatever message it is.
macro_rules! each {
    ($any:expr, $message:ident => $value:expr) => {
        match $any {
            AnyMessage::Reference($message) => $value,
            AnyMessage::StepCommand($message) => $value,
            AnyMessage::Feedback($message) => $value,
            AnyMessage::ControlStatus($message) => $value,
            AnyMessage::ControllerSnapshot($message) => $value,
            AnyMessage::PlantTruth($message) => $value,
            AnyMessage::BusStatus($message) => $value,
            AnyMessage::SetPoint($message) => $value,
            AnyMessage::OperatorCommand($message) => $value,
            AnyMessage::RecorderProgress($message) => $value,
            AnyMessage::LoopTiming(_, $message) => $value,
        }
    };
}

impl AnyMessage {
    /// The message's header.
    pub fn header(&self) -> &Header {
        each!(self, message => &message.header)
    }

    /// The channel it belongs to; `None` for the timing of a process that has no channel for it.
    pub fn topic(&self) -> Option<Topic> {
        match self {
            Self::Reference(_) => Some(Topic::Reference),
            Self::StepCommand(_) => Some(Topic::StepCommand),
            Self::Feedback(_) => Some(Topic::Feedback),
            Self::ControlStatus(_) => Some(Topic::ControlStatus),
            Self::ControllerSnapshot(_) => Some(Topic::ControllerSnapshot),
            Self::PlantTruth(_) => Some(Topic::PlantTruth),
            Self::BusStatus(_) => Some(Topic::BusStatus),
            Self::SetPoint(_) => Some(Topic::SetPoint),
            Self::OperatorCommand(_) => Some(Topic::OperatorCommand),
            Self::RecorderProgress(_) => Some(Topic::RecorderProgress),
            Self::LoopTiming(source, _) => Topic::of::<LoopTiming>(*source),
        }
    }

    /// Hands the bits of each field, header first, to `take`: as many as [`Header::FIELDS`] and
    /// [`Topic::body_fields`] together.
    pub fn each_word(&self, mut take: impl FnMut(u64)) {
        each!(self, message => {
            message.header.each_word(&mut take);
            message.body.each_word(take);
        });
    }

    /// A topic's message from its payload, checked as the loop's readers check it; `None` where that fails.
    pub(crate) fn decode(topic: Topic, payload: &[u8]) -> Option<Self> {
        Some(match topic {
            Topic::Reference => Self::Reference(body(topic, payload)?),
            Topic::StepCommand => Self::StepCommand(body(topic, payload)?),
            Topic::Feedback => Self::Feedback(body(topic, payload)?),
            Topic::ControlStatus => Self::ControlStatus(body(topic, payload)?),
            Topic::ControllerSnapshot => Self::ControllerSnapshot(body(topic, payload)?),
            Topic::PlantTruth => Self::PlantTruth(body(topic, payload)?),
            Topic::BusStatus => Self::BusStatus(body(topic, payload)?),
            Topic::SetPoint => Self::SetPoint(body(topic, payload)?),
            Topic::OperatorCommand => Self::OperatorCommand(body(topic, payload)?),
            Topic::RecorderProgress => Self::RecorderProgress(body(topic, payload)?),
            Topic::TrajectoryTiming | Topic::ControllerTiming | Topic::PlantTiming => {
                Self::LoopTiming(topic.source(), body(topic, payload)?)
            }
        })
    }
}

fn body<B: Body>(topic: Topic, payload: &[u8]) -> Option<Message<B>> {
    let message = cdr::body(payload).and_then(Message::<B>::from_bytes)?;
    // A record may span several generations, so the message's own is the one to expect.
    let expected = Expectation { source: topic.source(), generation: message.header.generation };
    check(&message, &expected).is_ok().then_some(message)
}

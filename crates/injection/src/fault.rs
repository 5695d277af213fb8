//! What can be made to go wrong.

use crate::by_name;
use serde::{Deserialize, Serialize};
use signals::{Body, ControlStatus, Feedback, Field, Header, Reference, Source, StepCommand};

/// The oldest message that can be replayed, in messages.
pub const MAX_AGE: u64 = 16;

/// A fault and when it begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct Injection {
    /// The first cycle of the process that it befalls; 0 for at once.
    pub at: u64,
    /// The fault.
    pub fault: Fault,
}

/// One way for the loop to go wrong.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// Something befalls `count` messages, one after the other.
    Message {
        /// Whose.
        stream: Stream,
        /// What.
        damage: Damage,
        /// How many; `u64::MAX` for all that follow.
        count: u64,
    },
    /// A process takes so many cycles for one, and skips those that it missed.
    Overrun {
        /// Which.
        #[serde(with = "by_name")]
        process: Source,
        /// How many.
        cycles: u64,
    },
    /// A process says nothing any more, as if it were dead.
    Silence {
        /// Which.
        #[serde(with = "by_name")]
        process: Source,
    },
    /// A process is killed (SIGKILL).
    Kill {
        /// Which.
        #[serde(with = "by_name")]
        process: Source,
    },
    /// A process is stopped for a while (SIGSTOP, SIGCONT).
    Pause {
        /// Which.
        #[serde(with = "by_name")]
        process: Source,
        /// How long.
        ms: u64,
    },
    /// Somebody else takes a core under SCHED_FIFO, above the loop.
    Hog {
        /// Which core.
        core: usize,
        /// How long.
        ms: u64,
    },
    /// The recorder's disk takes nothing for a while: writing waits.
    DiskStalled {
        /// How long.
        ms: u64,
    },
    /// The recorder's disk refuses everything, as a full one does, until the next segment is tried.
    DiskFull,
}

/// What becomes of a message.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Damage {
    /// It is lost.
    Drop,
    /// It comes twice.
    Duplicate,
    /// It comes after the next one.
    Delay,
    /// An old one comes in its place, 1 to [`MAX_AGE`] messages old.
    Replay {
        /// Its age in messages.
        age: u64,
    },
    /// A field has another value: the sender has computed nonsense, and sealed it.
    Field {
        /// Its place among the body's fields.
        index: usize,
        /// Its new bits.
        bits: u64,
    },
    /// Bits have flipped on the way.
    Flip {
        /// Places of the bits, header first; those beyond the message's end count from its beginning again.
        bits: Vec<u16>,
    },
    /// The sender was compiled with another layout.
    WrongSchema,
    /// The sender belongs to another start.
    WrongGeneration,
    /// Somebody else has sent it.
    WrongSource,
    /// For Feedback: the encoder's reading stays what it was.
    FrozenEncoder,
    /// For Feedback: the encoder's reading is off by so much.
    EncoderJump {
        /// By how much.
        by_rad: f64,
    },
}

/// The messages of the loop that faults befall.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "each variant is the message of its name")]
pub enum Stream {
    Reference,
    StepCommand,
    ControlStatus,
    Feedback,
}

impl Stream {
    /// All of them.
    pub const ALL: &'static [Self] =
        &[Self::Reference, Self::StepCommand, Self::ControlStatus, Self::Feedback];

    /// The name that the text form and the bus have for it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Reference => Reference::TOPIC,
            Self::StepCommand => StepCommand::TOPIC,
            Self::ControlStatus => ControlStatus::TOPIC,
            Self::Feedback => Feedback::TOPIC,
        }
    }

    /// The process that publishes it.
    pub const fn source(self) -> Source {
        match self {
            Self::Reference => Source::Trajectory,
            Self::StepCommand | Self::ControlStatus => Source::Controller,
            Self::Feedback => Source::Plant,
        }
    }

    /// The fields of its body.
    pub const fn fields(self) -> &'static [Field] {
        match self {
            Self::Reference => Reference::FIELDS,
            Self::StepCommand => StepCommand::FIELDS,
            Self::ControlStatus => ControlStatus::FIELDS,
            Self::Feedback => Feedback::FIELDS,
        }
    }

    /// The bits of a message, header included.
    pub fn bits(self) -> u16 {
        ((Header::FIELDS.len() + self.fields().len()) * 64) as u16
    }

    /// The stream that a body belongs to; `None` where faults never befall it.
    pub fn of<B: Body>() -> Option<Self> {
        Self::ALL.iter().copied().find(|stream| stream.name() == B::TOPIC)
    }
}

impl Fault {
    /// The process whose own shell carries it out; `None` where the supervisor does, from outside.
    pub fn within(&self) -> Option<Source> {
        match self {
            Self::Message { stream, .. } => Some(stream.source()),
            Self::Overrun { process, .. } | Self::Silence { process } => Some(*process),
            Self::DiskStalled { .. } | Self::DiskFull => Some(Source::Recorder),
            Self::Kill { .. } | Self::Pause { .. } | Self::Hog { .. } => None,
        }
    }

    /// Whether it means something where there is no clock: in lockstep and in one thread.
    pub fn without_clock(&self) -> bool {
        matches!(self, Self::Message { .. } | Self::Overrun { .. } | Self::Silence { .. })
    }
}

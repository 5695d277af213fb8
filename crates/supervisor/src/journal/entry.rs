//! A line of the journal.

use serde::{Deserialize, Serialize};
use std::fmt;

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// All processes run; the valve is disarmed.
    Ready,
    /// An operator's order was obeyed.
    Order,
    /// An operator's order was refused.
    Refused,
    /// An operator's note.
    Note,
    /// A fault was injected.
    Injection,
    /// The valve was stopped by a fault.
    Fault,
    /// Something that the operator has to know and that stops nothing.
    Alarm,
    /// The controller changed its state by itself.
    State,
    /// A process of the loop fell silent, or is heard again; it died, or was started anew.
    Process,
    /// The record: its process was replaced, the disk does not take it.
    Record,
    /// The instance ended.
    End,
}

impl EventKind {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ready => "ready",
            Self::Order => "order",
            Self::Refused => "refused",
            Self::Note => "note",
            Self::Injection => "injection",
            Self::Fault => "fault",
            Self::Alarm => "alarm",
            Self::State => "state",
            Self::Process => "process",
            Self::Record => "record",
            Self::End => "end",
        }
    }
}

/// What happened, when, and by whom.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// Wall-clock time, RFC 3339 in UTC, to the millisecond.
    pub time: String,
    /// The instance.
    pub instance: String,
    /// Counts the starts of its processes.
    pub generation: u64,
    /// The controller's cycle, as far as the supervisor had heard of it.
    pub cycle: u64,
    /// What kind of event.
    pub event: EventKind,
    /// Whose order it was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by: Option<String>,
    /// The event in words.
    pub text: String,
}

/// A line for people.
impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}  {:<9}  {}", self.time, self.event.name(), self.text)?;
        self.by.as_ref().map_or(Ok(()), |by| write!(f, "  [{by}]"))
    }
}

//! What lies between the roles of the loop in one thread: a wire that carries everything, or one that does not.

use signals::{ControlStatus, Feedback, Reference, Source, StepCommand};

/// Whether a process takes part in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Presence {
    /// It runs.
    Runs,
    /// It is still busy with an earlier cycle, and skips this one.
    PassedOver,
    /// It is dead.
    Silent,
}

/// Carries the messages of cycle `cycle` (the one in which they are sent) to their readers. By default every process
/// runs and every message arrives unchanged; an implementation overrides what it alters.
pub trait Wire {
    /// Whether a process takes part in a cycle.
    fn presence(&self, _source: Source, _cycle: u64) -> Presence {
        Presence::Runs
    }
    /// What arrives of Feedback k.
    fn feedback(&mut self, _cycle: u64, body: Feedback) -> Option<Feedback> {
        Some(body)
    }
    /// What arrives of Reference k+2.
    fn reference(&mut self, _cycle: u64, body: Reference) -> Option<Reference> {
        Some(body)
    }
    /// What arrives of StepCommand k+1.
    fn command(&mut self, _cycle: u64, body: StepCommand) -> Option<StepCommand> {
        Some(body)
    }
    /// What arrives of ControlStatus k.
    fn status(&mut self, _cycle: u64, body: ControlStatus) -> Option<ControlStatus> {
        Some(body)
    }
}

/// Everything arrives.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Perfect;

impl Wire for Perfect {}

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

/// Carries the messages of cycle `cycle` (the one in which they are sent) to those who read them.
pub trait Wire {
    /// Whether a process takes part in a cycle.
    fn presence(&self, source: Source, cycle: u64) -> Presence;
    /// What arrives of Feedback k.
    fn feedback(&mut self, cycle: u64, body: Feedback) -> Option<Feedback>;
    /// What arrives of Reference k+2.
    fn reference(&mut self, cycle: u64, body: Reference) -> Option<Reference>;
    /// What arrives of StepCommand k+1.
    fn command(&mut self, cycle: u64, body: StepCommand) -> Option<StepCommand>;
    /// What arrives of ControlStatus k.
    fn status(&mut self, cycle: u64, body: ControlStatus) -> Option<ControlStatus>;
}

/// Everything arrives.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Perfect;

impl Wire for Perfect {
    fn presence(&self, _source: Source, _cycle: u64) -> Presence {
        Presence::Runs
    }

    fn feedback(&mut self, _cycle: u64, body: Feedback) -> Option<Feedback> {
        Some(body)
    }

    fn reference(&mut self, _cycle: u64, body: Reference) -> Option<Reference> {
        Some(body)
    }

    fn command(&mut self, _cycle: u64, body: StepCommand) -> Option<StepCommand> {
        Some(body)
    }

    fn status(&mut self, _cycle: u64, body: ControlStatus) -> Option<ControlStatus> {
        Some(body)
    }
}

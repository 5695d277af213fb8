//! What arrives in a cycle, and what goes out.

use signals::{ControlStatus, Feedback, OperatorCommand, Reference, StepCommand};

/// What arrived in cycle k, already checked.
#[derive(Debug, Clone, Copy, Default)]
pub struct Input<'a> {
    /// Feedback k.
    pub feedback: Option<&'a Feedback>,
    /// Reference k+2.
    pub reference: Option<&'a Reference>,
    /// A new order of the operator's.
    pub order: Option<&'a OperatorCommand>,
}

/// What goes out in cycle k.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// StepCommand k+1.
    pub command: StepCommand,
    /// ControlStatus k.
    pub status: ControlStatus,
}

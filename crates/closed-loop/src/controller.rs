//! The step controller's role: Reference, Feedback and orders in; StepCommand and ControlStatus out.

use crate::snapshot::Snapshot;
use serde::{Deserialize, Serialize};
use signals::{Feedback, OperatorCommand, Reference};
use step_control::{Input, Output};

/// What the step controller is told: its belief, never the truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControllerPart {
    /// Belief, limits, reactions.
    pub params: step_control::Params,
    /// Where the command stands at the start, micro-steps.
    pub initial_microsteps: i64,
    /// Whether steps were lost before the start, and no zero was found since.
    pub zero_in_doubt: bool,
}

/// The controller between two cycles.
#[derive(Debug, Clone)]
pub struct ControllerRole {
    params: step_control::Params,
    state: step_control::State,
}

impl ControllerRole {
    /// A disarmed controller.
    pub fn new(part: &ControllerPart) -> Self {
        let state = step_control::State::new(part.initial_microsteps).with_zero_in_doubt(part.zero_in_doubt);
        Self { params: part.params.clone(), state }
    }

    /// One that goes on from a snapshot.
    pub fn resumed(part: &ControllerPart, snapshot: &Snapshot) -> Self {
        Self { params: part.params.clone(), state: snapshot.state }
    }

    /// The id of the last order that it looked at.
    pub fn operator_id(&self) -> u64 {
        self.state.operator_id()
    }

    /// Its state between two cycles.
    pub fn state(&self) -> &step_control::State {
        &self.state
    }

    /// StepCommand k+1 and ControlStatus k, from Feedback k, Reference k+2 and a new order if one came.
    pub fn step(
        &mut self,
        cycle: u64,
        feedback: Option<&Feedback>,
        reference: Option<&Reference>,
        order: Option<&OperatorCommand>,
    ) -> Output {
        step_control::step(&self.params, &mut self.state, cycle, &Input { feedback, reference, order })
    }

    /// The step of a cycle to come as far as its messages are there, on a copy of the state: its code and data lie in the caches then.
    /// Nothing comes of it.
    pub fn rehearse(&self, cycle: u64, feedback: Option<&Feedback>, reference: Option<&Reference>) {
        let mut state = self.state;
        let input = Input { feedback, reference, order: None };
        std::hint::black_box(step_control::step(&self.params, &mut state, cycle, &input));
    }
}

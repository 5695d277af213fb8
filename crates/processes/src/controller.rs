//! step-controller: Feedback, Reference and orders in, StepCommand and ControlStatus out.

use crate::child::{Child, ChildError};
use crate::inbox::Inbox;
use crate::outbox::Outbox;
use crate::paced::{self, Absence, Cyclic, Stamp};
use crate::part::ChildSummary;
use closed_loop::{ControllerPart, ControllerRole};
use injection::Injection;
use signals::{ControlStatus, Feedback, OperatorCommand, Reference, Source, StepCommand};

struct Controller {
    role: ControllerRole,
    command: Outbox<StepCommand>,
    status: Outbox<ControlStatus>,
    feedback: Inbox<Feedback>,
    reference: Inbox<Reference>,
    orders: Inbox<OperatorCommand>,
}

pub(crate) fn run(child: &Child, part: &ControllerPart) -> Result<Option<ChildSummary>, ChildError> {
    let controller = Controller {
        role: ControllerRole::new(part),
        command: Outbox::open(child, Source::Controller)?,
        status: Outbox::open(child, Source::Controller)?,
        feedback: Inbox::open(child, Source::Plant)?,
        reference: Inbox::open(child, Source::Trajectory)?,
        orders: Inbox::open(child, Source::Supervisor)?,
    };
    paced::run(child, controller)
}

impl Cyclic for Controller {
    const SOURCE: Source = Source::Controller;

    fn cycle(&mut self, cycle: u64, _skipped: u64, stamp: &mut Stamp) {
        let feedback = self.feedback.of_cycle(cycle);
        let reference = self.reference.of_cycle(cycle + 2);
        let order = self.orders.in_order();
        stamp.has_read();
        let output = self.role.step(cycle, feedback.as_ref(), reference.as_ref(), order.as_ref());
        stamp.has_stepped();
        self.command.write(cycle, cycle + 1, stamp.now(), output.command);
        self.status.write(cycle, cycle, stamp.now(), output.status);
        stamp.has_written();
    }

    fn pass_over(&mut self, cycle: u64, time_ns: u64, _why: Absence) {
        _ = self.feedback.of_cycle(cycle);
        _ = self.reference.of_cycle(cycle + 2);
        self.command.pass_over(cycle + 1, time_ns);
        self.status.pass_over(cycle, time_ns);
    }

    fn inject(&mut self, injection: &Injection) {
        self.command.inject(injection);
        self.status.inject(injection);
    }

    fn missed(&self) -> u64 {
        self.feedback.missed() + self.reference.missed() + self.orders.missed()
    }

    fn published(&self) -> (u64, u64) {
        (self.command.published() + self.status.published(), self.command.failures() + self.status.failures())
    }

    fn connect(&self) {
        self.command.connect();
        self.status.connect();
    }
}

//! step-controller: Feedback, Reference and orders in, StepCommand and ControlStatus out.

use crate::child::{Child, ChildError};
use crate::inbox::Inbox;
use crate::paced::{self, Cyclic, Stamp};
use crate::part::ChildSummary;
use closed_loop::{ControllerPart, ControllerRole};
use signal_bus::Writer;
use signals::{ControlStatus, Feedback, OperatorCommand, Reference, Source, StepCommand};

struct Controller {
    role: ControllerRole,
    command: Writer<StepCommand>,
    status: Writer<ControlStatus>,
    feedback: Inbox<Feedback>,
    reference: Inbox<Reference>,
    orders: Inbox<OperatorCommand>,
}

pub(crate) fn run(child: &Child, part: &ControllerPart) -> Result<Option<ChildSummary>, ChildError> {
    let controller = Controller {
        role: ControllerRole::new(part),
        command: child.bus.writer(Source::Controller)?,
        status: child.bus.writer(Source::Controller)?,
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
        self.command.write(cycle + 1, stamp.now(), output.command);
        self.status.write(cycle, stamp.now(), output.status);
        stamp.has_written();
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

//! step-controller: Feedback, Reference and orders in, StepCommand and ControlStatus out.

use crate::child::{Child, ChildError};
use crate::disarm::{DisarmDesk, straight_disarm};
use crate::inbox::Inbox;
use crate::outbox::Outbox;
use crate::paced::{self, Absence, Cyclic, Stamp};
use crate::part::ChildSummary;
use closed_loop::{ControllerPart, ControllerRole, SnapshotSender};
use injection::Injection;
use signal_bus::Writer;
use signals::{ControlStatus, ControllerSnapshot, Feedback, OperatorCommand, Reference, Source, StepCommand};
use std::sync::Arc;

struct Controller {
    phase_correction_ns: i64,
    role: ControllerRole,
    command: Outbox<StepCommand>,
    status: Outbox<ControlStatus>,
    feedback: Inbox<Feedback>,
    reference: Inbox<Reference>,
    orders: Inbox<OperatorCommand>,
    disarm_desk: Option<Arc<DisarmDesk>>,
    /// The state on its way to the recorder.
    snapshots: SnapshotSender,
    snapshot: Writer<ControllerSnapshot>,
    /// Disarms that came to the desk and were obeyed.
    disarms: u64,
    /// The id of the newest order.
    last_id: u64,
}

pub(crate) fn run(child: &Child, part: &ControllerPart) -> Result<Option<ChildSummary>, ChildError> {
    let controller = Controller {
        phase_correction_ns: 0,
        role: ControllerRole::new(part),
        command: Outbox::open(child, Source::Controller)?,
        status: Outbox::open(child, Source::Controller)?,
        feedback: Inbox::open(child, Source::Plant)?,
        reference: Inbox::open(child, Source::Trajectory)?,
        orders: Inbox::open(child, Source::Supervisor)?,
        disarm_desk: child.disarm_desk.clone(),
        snapshots: SnapshotSender::new(part.params.period_s),
        snapshot: child.bus.writer(Source::Controller)?,
        disarms: 0,
        last_id: 0,
    };
    paced::run(child, controller)
}

impl Controller {
    /// The order of this cycle: a disarm that came straight here, or the supervisor's next. What the supervisor wanted
    /// before a disarm is not done after it.
    fn order(&mut self) -> Option<OperatorCommand> {
        let asked = self.disarm_desk.as_ref().map_or(0, |desk| desk.asked());
        if asked == self.disarms {
            let order = self.orders.in_order();
            self.last_id = order.map_or(self.last_id, |order| order.id);
            return order;
        }
        self.disarms = asked;
        while let Some(passed_over) = self.orders.in_order() {
            self.last_id = passed_over.id;
        }
        self.last_id += 1;
        Some(straight_disarm(self.last_id))
    }
}

impl Cyclic for Controller {
    const SOURCE: Source = Source::Controller;

    fn make_ready(&mut self, cycle: u64) {
        self.command.make_ready();
        self.status.make_ready();
        self.snapshot.make_ready();
        self.orders.touch();
        let (feedback, reference) = (self.feedback.make_ready(cycle), self.reference.make_ready(cycle + 2));
        self.role.rehearse(cycle, feedback, reference);
    }

    fn cycle(&mut self, cycle: u64, _skipped: u64, stamp: &mut Stamp) {
        let feedback = self.feedback.of_cycle(cycle);
        if let Some(feedback) = &feedback {
            self.phase_correction_ns = feedback.phase_correction_ns;
        }
        let reference = self.reference.of_cycle(cycle + 2);
        let order = self.order();
        stamp.has_read();
        let snapshot = self.snapshots.next(cycle, self.role.state());
        let output = self.role.step(cycle, feedback.as_ref(), reference.as_ref(), order.as_ref());
        if let Some(desk) = &self.disarm_desk {
            let heard = output.status.feedback_silent_cycles == 0;
            desk.obeyed(self.disarms, output.status.state, heard);
        }
        stamp.has_stepped();
        self.command.write(cycle, cycle + 1, stamp.now(), output.command);
        self.status.write(cycle, cycle, stamp.now(), output.status);
        if let Some(part) = snapshot {
            self.snapshot.write(cycle, stamp.now(), part);
        }
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

    fn phase_correction_ns(&self) -> i64 {
        self.phase_correction_ns
    }

    fn missed(&self) -> u64 {
        self.feedback.missed() + self.reference.missed() + self.orders.missed()
    }

    fn published(&self) -> (u64, u64) {
        (
            self.command.published() + self.status.published() + self.snapshot.published(),
            self.command.failures() + self.status.failures() + self.snapshot.failures(),
        )
    }

    fn connect(&self) {
        self.command.connect();
        self.status.connect();
        self.snapshot.connect();
    }
}

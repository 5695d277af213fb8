//! trajectory-generator: Feedback, ControlStatus and set-points in, Reference out.

use crate::child::{Child, ChildError};
use crate::inbox::Inbox;
use crate::outbox::Outbox;
use crate::paced::{self, Absence, Cyclic, Stamp};
use crate::part::ChildSummary;
use closed_loop::{TrajectoryPart, TrajectoryRole};
use injection::Injection;
use signals::{ControlStatus, Feedback, Reference, SetPoint, Source};

struct Trajectory {
    phase_correction_ns: i64,
    role: TrajectoryRole,
    reference: Outbox<Reference>,
    feedback: Inbox<Feedback>,
    status: Inbox<ControlStatus>,
    set_points: Inbox<SetPoint>,
}

pub(crate) fn run(child: &Child, part: TrajectoryPart) -> Result<Option<ChildSummary>, ChildError> {
    let trajectory = Trajectory {
        phase_correction_ns: 0,
        role: TrajectoryRole::new(part),
        reference: Outbox::open(child, Source::Trajectory)?,
        feedback: Inbox::open(child, Source::Plant)?,
        status: Inbox::open(child, Source::Controller)?,
        set_points: Inbox::open(child, Source::Supervisor)?,
    };
    paced::run(child, trajectory)
}

impl Cyclic for Trajectory {
    const SOURCE: Source = Source::Trajectory;

    fn make_ready(&mut self, cycle: u64) {
        self.reference.make_ready();
        self.set_points.touch();
        let status = cycle.checked_sub(1).and_then(|previous| self.status.make_ready(previous));
        self.role.rehearse(cycle, self.feedback.make_ready(cycle), status);
    }

    fn cycle(&mut self, cycle: u64, _skipped: u64, stamp: &mut Stamp) {
        let status = cycle.checked_sub(1).and_then(|previous| self.status.of_cycle(previous));
        let feedback = self.feedback.of_cycle(cycle);
        if let Some(feedback) = &feedback {
            self.phase_correction_ns = feedback.phase_correction_ns;
        }
        // One set-point a cycle; the scenario's come first.
        let set_point = if self.role.has_due(cycle) { None } else { self.set_points.in_order() };
        stamp.has_read();
        let reference = self.role.step(cycle, feedback.as_ref(), status.as_ref(), set_point.as_ref());
        stamp.has_stepped();
        self.reference.write(cycle, cycle + 2, stamp.now(), reference);
        stamp.has_written();
    }

    fn pass_over(&mut self, cycle: u64, time_ns: u64, _why: Absence) {
        _ = cycle.checked_sub(1).and_then(|previous| self.status.of_cycle(previous));
        _ = self.feedback.of_cycle(cycle);
        self.reference.pass_over(cycle + 2, time_ns);
    }

    fn inject(&mut self, injection: &Injection) {
        self.reference.inject(injection);
    }

    fn phase_correction_ns(&self) -> i64 {
        self.phase_correction_ns
    }

    fn missed(&self) -> u64 {
        self.feedback.missed() + self.status.missed() + self.set_points.missed()
    }

    fn published(&self) -> (u64, u64) {
        (self.reference.published(), self.reference.failures())
    }

    fn connect(&self) {
        self.reference.connect();
    }
}

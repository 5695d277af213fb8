//! valve-bridge, in the plant simulator's place: StepCommand in, one frame to the drive, Feedback out. It has no PlantTruth: nobody
//! knows it.

use crate::bus_news::BusNews;
use crate::child::{Child, ChildError};
use crate::inbox::Inbox;
use crate::outbox::Outbox;
use crate::paced::{self, Absence, Cyclic, Stamp};
use crate::part::{BridgePart, ChildSummary};
use ethercat_link::{Bridge, PacketLink};
use injection::Injection;
use signal_bus::Writer;
use signals::{
    BusPhase, BusStatus, ControlStatus, ControllerState, Feedback, OperatorCommand, OperatorKind, Source,
    StepCommand, validity,
};

struct ValveBridge {
    bridge: Bridge<PacketLink>,
    period_ns: u64,
    phase_ns: u64,
    feedback: Outbox<Feedback>,
    bus_status: Writer<BusStatus>,
    commands: Inbox<StepCommand>,
    status: Inbox<ControlStatus>,
    orders: Inbox<OperatorCommand>,
    /// The id of the newest order.
    newest_order: u64,
    was_in_fault: bool,
    standstill_told: bool,
    news: BusNews,
}

/// Looks at the drive first: a wrong one is refused before anything runs.
pub(crate) fn run(child: &Child, part: BridgePart) -> Result<Option<ChildSummary>, ChildError> {
    let BridgePart { interface, params } = part;
    let link = PacketLink::open(&interface)
        .map_err(|error| ChildError::Link { interface: interface.clone(), error })?;
    let counts_per_turn = params.axis.counts_per_turn();
    let mut bridge = Bridge::new(link, params);
    bridge.check().map_err(|error| ChildError::Drive { interface: interface.clone(), error })?;
    let bridge = ValveBridge {
        bridge,
        period_ns: child.timeline.period_ns,
        phase_ns: child.phase_ns,
        feedback: Outbox::open(child, Source::Plant)?.with_encoder(counts_per_turn),
        bus_status: child.bus.writer(Source::Plant)?,
        commands: Inbox::open(child, Source::Controller)?,
        status: Inbox::open(child, Source::Controller)?,
        orders: Inbox::open(child, Source::Supervisor)?,
        newest_order: 0,
        was_in_fault: false,
        standstill_told: true,
        news: BusNews::of(interface).map_err(ChildError::Thread)?,
    };
    paced::run(child, bridge)
}

impl ValveBridge {
    /// Whether the operator's reset took the controller out of its fault, since the last cycle.
    fn reset(&mut self, cycle: u64) -> bool {
        let Some(status) = cycle.checked_sub(1).and_then(|previous| self.status.of_cycle(previous)) else {
            return false;
        };
        let in_fault = status.state == ControllerState::Fault.code();
        std::mem::replace(&mut self.was_in_fault, in_fault) && !in_fault
    }

    /// An order to home goes to the drive too; whether it is obeyed the controller says, by asking for current.
    fn hear_orders(&mut self, cycle: u64) {
        while let Some(order) = self.orders.in_order() {
            let new = order.id > self.newest_order && cycle <= order.valid_until_cycle;
            self.newest_order = self.newest_order.max(order.id);
            if new && order.kind == OperatorKind::Home.code() {
                self.bridge.home();
            }
        }
    }
}

impl Cyclic for ValveBridge {
    const SOURCE: Source = Source::Plant;

    fn cycle(&mut self, cycle: u64, skipped: u64, stamp: &mut Stamp) {
        for missed in cycle - skipped..cycle {
            // Nothing was sent then; a command of the past is none.
            let _ = self.commands.of_cycle(missed);
        }
        let command = if cycle == 0 { None } else { self.commands.of_cycle(cycle) };
        let reset = self.reset(cycle);
        self.hear_orders(cycle);
        stamp.has_read();
        let begin_ns = stamp.deadline_ns().saturating_sub(self.phase_ns);
        let feedback = self.bridge.cycle(cycle, begin_ns, command.as_ref(), reset);
        stamp.has_stepped();
        if let Some(feedback) = feedback {
            self.feedback.write(cycle, cycle, stamp.now(), feedback);
            self.standstill_told = feedback.validity & validity::STANDSTILL != 0;
        }
        self.bus_status.write(cycle, stamp.now(), self.bridge.status());
        self.news.tell((self.bridge.phase(), self.bridge.error()));
        stamp.has_written();
    }

    /// There is no bridge without a clock.
    fn pass_over(&mut self, cycle: u64, time_ns: u64, _why: Absence) {
        self.feedback.pass_over(cycle, time_ns);
    }

    fn phase_correction_ns(&self) -> i64 {
        self.bridge.correction_ns()
    }

    fn is_warm(&self) -> bool {
        self.bridge.phase() == BusPhase::Operate
    }

    fn leave(&mut self) {
        self.bridge.leave(self.period_ns);
    }

    fn inject(&mut self, injection: &Injection) {
        self.feedback.inject(injection);
    }

    fn missed(&self) -> u64 {
        self.commands.missed() + self.status.missed() + self.orders.missed()
    }

    fn published(&self) -> (u64, u64) {
        (
            self.feedback.published() + self.bus_status.published(),
            self.feedback.failures() + self.bus_status.failures(),
        )
    }

    fn connect(&self) {
        self.feedback.connect();
        self.bus_status.connect();
    }

    fn may_end(&self) -> bool {
        self.standstill_told
    }
}

//! The bridge: StepCommand k in, Feedback k out, one frame a cycle, and the bus brought up again when it was lost.

use crate::bring_up::{BroughtUp, Wanted, bring_up};
use crate::error::{BringUpError, Step};
use crate::exchange::{Back, Wire};
use crate::link::Link;
use crate::main_device::{self, Grid};
use crate::params::BridgeParams;
use crate::probe::ask;
use crate::pump::Pump;
use core::future::Future;
use core::pin::Pin;
use core::task::Poll;
use ethercrab::MainDevice;
use fieldbus::{Axis, Clock, ClockParams, Exchange, Outcome, Outputs, OwnLimits, Plan};
use signals::{BusPhase, BusStatus, Feedback, StepCommand};

/// Locked means so near, ns, for so many cycles. A frame that a stall held up on its way says nothing about the clock: one further
/// away counts against some near ones, so that more than 95 of 100 have to be near.
const LOCK_WINDOW_NS: i64 = 50_000;
const LOCK_CYCLES: u64 = 200;
const FAR_COUNTS: u64 = 20;
/// A bring-up begins once the drive answered so many cycles' questions, ns: by then frames that a fault delayed have arrived. A question without
/// an answer counts against some answers, a wrong number of devices against all.
const CALM_NS: u64 = 50_000_000;
const MISSED_COUNTS: u64 = 5;
/// Locking, and coming to OP, take no longer, ns.
const LOCK_LIMIT_NS: u64 = 10_000_000_000;
const START_LIMIT_NS: u64 = 3_000_000_000;
/// A bring-up takes no longer, ns; after a failure the drive is looked for again after this time, and so long it may be away untold.
const BRING_UP_LIMIT_NS: u64 = 10_000_000_000;
const RETRY_NS: u64 = 500_000_000;
/// OP, with the acknowledgement of an error.
const OP: u16 = 0x08;

type BringUp = Pin<Box<dyn Future<Output = Result<BroughtUp, BringUpError>>>>;

enum State {
    Wait {
        until_ns: u64,
    },
    /// It is asked every cycle who is there; what is wrong was told at `told_ns`.
    Seek {
        answered: u64,
        told_ns: u64,
    },
    BringUp {
        future: BringUp,
        until_ns: u64,
    },
    Lock {
        wire: Wire,
        clock: Clock,
        locked: u64,
        until_ns: u64,
    },
    Start {
        wire: Wire,
        clock: Clock,
        until_ns: u64,
    },
    Operate {
        wire: Wire,
        clock: Clock,
    },
}

/// A drive behind a link.
pub struct Bridge<L> {
    link: L,
    main: &'static MainDevice<'static>,
    pump: Pump,
    params: BridgeParams,
    plan: Plan,
    axis: Axis,
    state: State,
    status: BusStatus,
    correction_ns: i64,
    error: Option<BringUpError>,
}

impl<L> core::fmt::Debug for Bridge<L> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Bridge").field("status", &self.status).finish_non_exhaustive()
    }
}

impl<L: Link> Bridge<L> {
    /// A bridge that has sent nothing yet.
    pub fn new(link: L, params: BridgeParams) -> Self {
        let (main, pump) = main_device::make();
        let limits = OwnLimits::of(&params.axis.drive, params.file.units_per_rev);
        let plan = Plan::new(&params.file, params.period_ns, limits);
        Self {
            axis: Axis::new(params.axis),
            state: State::Wait { until_ns: 0 },
            correction_ns: 0,
            error: None,
            link,
            main,
            pump,
            params,
            plan,
            status: BusStatus::default(),
        }
    }

    /// Makes sure, before the first cycle, that the right drive is there and takes its settings.
    ///
    /// # Errors
    /// [`BringUpError`] says what is not as it should be.
    pub fn check(&mut self) -> Result<(), BringUpError> {
        let now_ns = self.link.now_ns();
        let mut future = self.begin(now_ns);
        let until_ns = now_ns + BRING_UP_LIMIT_NS;
        match self.pump.poll_until(future.as_mut(), &mut self.link, until_ns) {
            Poll::Ready(result) => result.map(|_| ()),
            Poll::Pending => Err(BringUpError::Timeout { limit_ns: BRING_UP_LIMIT_NS }),
        }
    }

    /// What our deadlines are to be shifted by, ns.
    pub fn correction_ns(&self) -> i64 {
        self.correction_ns
    }

    /// What the bridge is doing with the bus.
    pub fn phase(&self) -> BusPhase {
        match self.state {
            State::Wait { .. } | State::Seek { .. } => BusPhase::Wait,
            State::BringUp { .. } => BusPhase::BringUp,
            State::Lock { .. } => BusPhase::Lock,
            State::Start { .. } => BusPhase::Start,
            State::Operate { .. } => BusPhase::Operate,
        }
    }

    /// What is known of the bus after the last cycle.
    pub fn status(&self) -> BusStatus {
        self.status
    }

    /// Why the last bring-up failed, or why none begins.
    pub fn error(&self) -> Option<BringUpError> {
        self.error
    }

    /// Whether the drive follows commands.
    pub fn enabled(&self) -> bool {
        self.axis.enabled()
    }

    /// The operator orders the drive to find its zero, where it is the drive that does.
    pub fn home(&mut self) {
        self.axis.home();
    }

    /// The link.
    pub fn link(&mut self) -> &mut L {
        &mut self.link
    }

    /// Does cycle `cycle`, which began at `begin_ns` on the link's clock (shifted by the correction): Feedback `cycle`, `None`
    /// where nothing is known of it. `reset` is the operator's, once.
    pub fn cycle(
        &mut self,
        cycle: u64,
        begin_ns: u64,
        command: Option<&StepCommand>,
        reset: bool,
    ) -> Option<Feedback> {
        let until_ns = begin_ns + u64::from(self.params.reply_until_ns);
        let state = core::mem::replace(&mut self.state, State::Wait { until_ns: 0 });
        let (state, feedback) = match state {
            State::Operate { wire, clock } => {
                self.operate(wire, clock, (cycle, begin_ns, until_ns), command, reset)
            }
            other => {
                let feedback = self.axis.down(cycle, command);
                (self.come_up(other, begin_ns, until_ns), Some(feedback))
            }
        };
        self.state = state;
        self.status.phase = self.phase().code();
        self.status.lost_frames = self.axis.lost_frames();
        feedback
    }

    /// Lets the drive go: no current, and out of OP, so that its watchdog finds nothing to complain of.
    pub fn leave(&mut self, period_ns: u64) {
        /// Long enough for the drive to let go.
        const CYCLES: u64 = 10;
        const INIT: u16 = 0x01;
        let State::Operate { mut wire, .. } =
            core::mem::replace(&mut self.state, State::Wait { until_ns: 0 })
        else {
            return;
        };
        let outputs = self.axis.let_go();
        for cycle in 0..=CYCLES {
            let until_ns = self.link.now_ns() + period_ns;
            let state = (cycle == CYCLES).then_some(INIT);
            let _ = wire.exchange(&mut self.link, &outputs, state, until_ns);
            let mut buffer = [0; 64];
            while self.link.now_ns() < until_ns && self.link.receive(&mut buffer, until_ns).is_ok() {}
        }
    }

    fn begin(&mut self, origin_ns: u64) -> BringUp {
        self.status.bring_ups += 1;
        let period_ns = self.params.period_ns;
        // The device brakes within so many cycles and one more, as the guard does. The longest gap that is no fault is of one frame
        // less, and a frame may come as late as a reply.
        let silence_ns = (self.params.file.bus_lost_cycles + 1) * u64::from(period_ns);
        let wanted = Wanted {
            file: self.params.file.clone(),
            plan: self.plan.clone(),
            grid: Grid { origin_ns, period_ns },
            watchdog_ns: silence_ns,
        };
        Box::pin(bring_up(self.main, wanted))
    }

    /// A cycle on the way to operation.
    fn come_up(&mut self, state: State, begin_ns: u64, until_ns: u64) -> State {
        match state {
            State::Wait { until_ns: at } if begin_ns >= at => self.seek(0, begin_ns, (begin_ns, until_ns)),
            State::Seek { answered, told_ns } => self.seek(answered, told_ns, (begin_ns, until_ns)),
            State::BringUp { mut future, until_ns: limit } => {
                match self.pump.poll_until(future.as_mut(), &mut self.link, until_ns) {
                    Poll::Ready(Ok(device)) => self.lock_onto(&device, begin_ns),
                    Poll::Ready(Err(error)) => self.failed(error, begin_ns),
                    Poll::Pending if begin_ns > limit => {
                        self.failed(BringUpError::Timeout { limit_ns: BRING_UP_LIMIT_NS }, begin_ns)
                    }
                    Poll::Pending => State::BringUp { future, until_ns: limit },
                }
            }
            State::Lock { wire, clock, locked, until_ns: limit } => {
                self.lock(wire, clock, locked, limit, (begin_ns, until_ns))
            }
            State::Start { wire, clock, until_ns: limit } => {
                self.start(wire, clock, limit, (begin_ns, until_ns))
            }
            other => other,
        }
    }

    /// Asks who is there, and begins a bring-up once the one drive, and nobody else, has answered for long enough.
    fn seek(&mut self, answered: u64, told_ns: u64, (begin_ns, until_ns): (u64, u64)) -> State {
        let period_ns = u64::from(self.params.period_ns.max(1));
        let found = ask(&mut self.link, (begin_ns / period_ns) as u8, until_ns);
        let answered = match found {
            Some(1) => answered + 1,
            Some(_) => 0,
            None => answered.saturating_sub(MISSED_COUNTS),
        };
        if answered * period_ns >= CALM_NS {
            let future = self.begin(begin_ns);
            return State::BringUp { future, until_ns: begin_ns + BRING_UP_LIMIT_NS };
        }
        if answered == 0 && begin_ns >= told_ns + RETRY_NS {
            self.error = Some(BringUpError::Count { found: found.unwrap_or(0).into(), expected: 1 });
            return State::Seek { answered, told_ns: begin_ns };
        }
        State::Seek { answered, told_ns }
    }

    fn failed(&mut self, error: BringUpError, now_ns: u64) -> State {
        self.error = Some(error);
        State::Wait { until_ns: now_ns + RETRY_NS }
    }

    fn lock_onto(&mut self, device: &BroughtUp, begin_ns: u64) -> State {
        let Some(wire) = Wire::new(device.station, self.params.file.layout()) else {
            let (found, _) = self.params.file.layout().sizes();
            return self.failed(BringUpError::Size { what: "outputs", found, expected: 0 }, begin_ns);
        };
        let params =
            ClockParams { period_ns: self.params.period_ns.into(), place_ns: self.params.place_ns.into() };
        // A faster clock on the bus draws our deadlines forward.
        let rate_ns = -device.rate * f64::from(self.params.period_ns);
        let clock = Clock::new(params, device.sync0_ns, self.correction_ns, rate_ns);
        State::Lock { wire, clock, locked: 0, until_ns: begin_ns + LOCK_LIMIT_NS }
    }

    /// Exchanges a frame, and lets the clock follow it.
    fn exchange(
        &mut self,
        wire: &mut Wire,
        clock: &mut Clock,
        outputs: &Outputs,
        al_request: Option<u16>,
        until_ns: u64,
    ) -> Back {
        let back = wire.exchange(&mut self.link, outputs, al_request, until_ns);
        match back {
            Back::Reply { sent_ns, system_time_ns, round_trip_ns, .. } => {
                // A process that woke late says nothing about the clocks: what counts is where a frame on time would be.
                let planned_ns = until_ns - u64::from(self.params.reply_until_ns - self.params.place_ns);
                let late_ns = sent_ns.saturating_sub(planned_ns);
                let error_ns = clock.error_ns(system_time_ns.wrapping_sub(late_ns));
                self.correction_ns = clock.follow(error_ns);
                self.status.clock_error_ns = error_ns;
                self.status.round_trip_ns = round_trip_ns;
                self.note_reply(&back);
            }
            Back::Nothing | Back::NotSent => self.correction_ns = clock.coast(),
        }
        self.status.late_replies += core::mem::take(&mut wire.late);
        back
    }

    /// What a reply says of the device and the drive, for people.
    fn note_reply(&mut self, back: &Back) {
        let Back::Reply { working_counter, al_status, al_code, inputs, .. } = *back else { return };
        self.status.working_counter = working_counter.into();
        (self.status.al_status, self.status.al_code) = (al_status.into(), al_code.into());
        if let Some(inputs) = inputs {
            self.status.drive_status = inputs.status.into();
            self.status.error_code = inputs.error_code.into();
            self.status.mode = inputs.mode.into();
        }
    }

    fn lock(
        &mut self,
        mut wire: Wire,
        mut clock: Clock,
        locked: u64,
        limit: u64,
        (begin_ns, until_ns): (u64, u64),
    ) -> State {
        let back = self.exchange(&mut wire, &mut clock, &Outputs::default(), None, until_ns);
        let near = self.status.clock_error_ns.abs() <= LOCK_WINDOW_NS;
        let locked = match back {
            Back::Reply { exchanged: true, .. } if near => locked + 1,
            // A frame that was lost says nothing about the clock.
            Back::Nothing | Back::NotSent => locked,
            Back::Reply { .. } => locked.saturating_sub(FAR_COUNTS),
        };
        if locked >= LOCK_CYCLES {
            return State::Start { wire, clock, until_ns: begin_ns + START_LIMIT_NS };
        }
        if begin_ns > limit {
            let error_ns = self.status.clock_error_ns;
            let (near, wanted) = (locked, LOCK_CYCLES);
            let error = BringUpError::NotLocked { near, wanted, error_ns, expected_ns: LOCK_WINDOW_NS };
            return self.failed(error, begin_ns);
        }
        State::Lock { wire, clock, locked, until_ns: limit }
    }

    fn start(
        &mut self,
        mut wire: Wire,
        mut clock: Clock,
        limit: u64,
        (begin_ns, until_ns): (u64, u64),
    ) -> State {
        let back = self.exchange(&mut wire, &mut clock, &Outputs::default(), Some(OP), until_ns);
        match back {
            Back::Reply { al_status, exchanged: true, .. } if al_status & 0x1F == OP => {
                self.axis.brought_up();
                self.error = None;
                State::Operate { wire, clock }
            }
            Back::Reply { al_status, al_code, .. } if al_status & 0x10 != 0 || begin_ns > limit => {
                self.failed(BringUpError::State { step: Step::Op, al_status, al_code }, begin_ns)
            }
            _ if begin_ns > limit => {
                self.failed(BringUpError::Timeout { limit_ns: START_LIMIT_NS }, begin_ns)
            }
            _ => State::Start { wire, clock, until_ns: limit },
        }
    }

    fn operate(
        &mut self,
        mut wire: Wire,
        mut clock: Clock,
        (cycle, begin_ns, until_ns): (u64, u64, u64),
        command: Option<&StepCommand>,
        reset: bool,
    ) -> (State, Option<Feedback>) {
        let sent = self.axis.send(cycle, command, reset);
        let back = self.exchange(&mut wire, &mut clock, &sent.outputs, None, until_ns);
        let (outcome, inputs) = match back {
            Back::Reply { exchanged: true, al_status, al_code, inputs, .. } => {
                let clock_error_ns = self.status.clock_error_ns;
                (Outcome::Answered { al_status, al_code, clock_error_ns }, inputs)
            }
            Back::Reply { working_counter, .. } => (Outcome::WorkingCounter { found: working_counter }, None),
            Back::Nothing => (Outcome::Missing, None),
            Back::NotSent => (Outcome::NotSent, None),
        };
        let exchange = Exchange { outcome, inputs, phase_correction_ns: self.correction_ns };
        let feedback = self.axis.receive(cycle, &exchange);
        if self.axis.needs_bring_up() {
            // The drive's own ramp first: a bring-up would take its current away.
            let drive = &self.params.axis.drive;
            let cycles = drive::stop_cycles_bound(drive) + self.params.file.bus_lost_cycles + 2;
            let ramp_ns = cycles * u64::from(self.params.period_ns);
            return (State::Wait { until_ns: begin_ns + ramp_ns }, feedback);
        }
        (State::Operate { wire, clock }, feedback)
    }
}

//! A drive as the plant of the loop: StepCommand k into the frame that is active from t_k+1, the inputs of t_k into Feedback k.
//!
//! The guard (`drive::step`) is the last before the wire, and it advances on confirmed frames alone: where a reply is missing, it
//! goes back to where it was, so a gap never becomes a leap of the absolute target.
//!
//! ```text
//!            energise 1                 0x27, mode 8, bit 12
//!  Off ────────────────▶ Enabling ───────────────────────────▶ Enabled
//!   │                       ▲ homed                               │
//!   ├── the same, home ──▶ Homing ──too long, bit 13──▶ Failed    │
//!   ▲  ◀───────────────     │                                     │
//!   │     energise 0        │ too long, fault, bus lost           │ left 0x27, fault, bus lost
//!   │                       ▼                                     ▼
//!   └──── released ──── Failed ◀──────────────────────────────────┘
//! ```
//! Failed is latched. It is released by an operator's reset, or by a controller that wants no current; never by itself.

mod params;
mod report;

pub use params::AxisParams;

use crate::cia402::{Cia402, DriveState, Order, control};
use crate::counter::Counter;
use crate::drive_file::{Homing, Profile};
use crate::judge::{BusFault, Judge, Outcome, Verdict};
use crate::process_data::{Inputs, Outputs};
use report::Moved;
use signals::{FaultCode, Feedback, StepCommand};

/// Bit 12 of the status word in cyclic synchronous position: the drive follows the command value.
const FOLLOWS: u16 = 1 << 12;
const CSP: i8 = 8;
const HOMING: i8 = 6;
/// In homing: bit 12 is attained, bit 10 at the target, bit 13 an error.
const ATTAINED: u16 = 1 << 12 | 1 << 10;
const HOMING_ERROR: u16 = 1 << 13;
/// Cycles after the start of homing in which the status word may still tell of an earlier one.
const STALE_CYCLES: u64 = 2;
/// An order to home is forgotten where no current is asked for within so many cycles: the controller refused it.
const ORDER_CYCLES: u64 = 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Off,
    Enabling {
        cycles: u64,
    },
    /// The drive finds its zero; so many cycles since the start, and since it was told to begin.
    Homing {
        cycles: u64,
        begun: u64,
    },
    Enabled,
    Failed {
        at_cycle: u64,
    },
}

/// A zero that the controller found: what it adds to the counts of the command, and to the encoder's angle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Zero {
    id: u64,
    microsteps: i64,
    encoder_rad: f64,
}

/// What is taken back where a frame is not confirmed, and the motion that it carries.
#[derive(Debug, Clone)]
struct Unconfirmed {
    guard: drive::State,
    zero: Zero,
    moved: Moved,
}

/// What a cycle's frame carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sent {
    /// The process data.
    pub outputs: Outputs,
}

/// What became of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exchange {
    /// The reply.
    pub outcome: Outcome,
    /// The inputs, where there was one with good process data.
    pub inputs: Option<Inputs>,
    /// What our clock is shifted by, ns.
    pub phase_correction_ns: i64,
}

/// The axis between two cycles.
#[derive(Debug, Clone)]
pub struct Axis {
    params: AxisParams,
    judge: Judge,
    cia402: Cia402,
    phase: Phase,
    fault: FaultCode,
    guard: drive::State,
    /// What was before this cycle's frame, until the frame is confirmed.
    unconfirmed: Option<Unconfirmed>,
    zero: Zero,
    /// The drive found its zero since its last bring-up, or the controller one.
    found_zero: bool,
    /// The controller doubts the zero, and none was found since.
    zero_in_doubt: bool,
    /// Cycles for which an order to home still counts.
    home_order: u64,
    /// Motions under way: of the frame before, and of the one before that.
    moved: [Moved; 2],
    /// The position on the bus; `None` until the first inputs.
    counter: Option<Counter>,
    inputs: Inputs,
    al: (u16, u16),
    /// The bus is lost, or the device out of operation: only a bring-up helps.
    bus_down: bool,
    last_target: i64,
    /// Cycles in a row without a command, and what the last one said.
    silent_cycles: u64,
    energise: bool,
    /// The operator's reset, until it has released the fault.
    release: bool,
    /// The cycle before; `None` before the first in operation.
    last_cycle: Option<u64>,
    phase_correction_ns: i64,
}

impl Axis {
    /// An axis whose drive has not been heard yet.
    pub fn new(params: AxisParams) -> Self {
        Self {
            judge: Judge::new(params.judge),
            cia402: Cia402::default(),
            phase: Phase::Off,
            fault: FaultCode::None,
            guard: drive::State::at_rest(0),
            unconfirmed: None,
            zero: Zero::default(),
            found_zero: false,
            zero_in_doubt: false,
            home_order: 0,
            moved: [Moved::at_rest(0, Zero::default()); 2],
            counter: None,
            inputs: Inputs::default(),
            al: (0, 0),
            bus_down: false,
            last_target: 0,
            silent_cycles: 0,
            energise: false,
            release: false,
            last_cycle: None,
            phase_correction_ns: 0,
            params,
        }
    }

    /// The bus was brought up again: the drive is off, and its position is read anew. A fault stays until it is released.
    pub fn brought_up(&mut self) {
        let latched = (self.phase, self.fault);
        let lost = self.judge;
        // A zero lasts where the position on the bus is absolute. An old one is never taken again.
        let lasts = matches!(self.params.homing, Homing::Absolute { .. });
        let zero = if lasts { self.zero } else { Zero { id: self.zero.id, ..Zero::default() } };
        let found_zero = lasts && self.found_zero;
        let guard = drive::State::at_rest(0).with_zero(zero.id, zero.microsteps);
        let (moved, zero_in_doubt) = (self.moved, self.zero_in_doubt);
        *self = Self { judge: lost, moved, zero, found_zero, zero_in_doubt, guard, ..Self::new(self.params) };
        self.judge.clear();
        if matches!(latched.0, Phase::Failed { .. }) {
            (self.phase, self.fault) = latched;
        }
    }

    /// Whether the bus is lost or the device out of operation, so that only a bring-up helps.
    pub fn needs_bring_up(&self) -> bool {
        self.bus_down
    }

    /// Whether the drive follows the guard.
    pub fn enabled(&self) -> bool {
        self.phase == Phase::Enabled
    }

    /// Frames without a good reply so far.
    pub fn lost_frames(&self) -> u64 {
        self.judge.lost_frames()
    }

    /// The operator wants the drive to find its zero: it does so when the controller asks for current next.
    pub fn home(&mut self) {
        if matches!(self.params.homing, Homing::Drive { .. }) {
            self.home_order = ORDER_CYCLES;
        }
    }

    /// Makes the process data of cycle `cycle` with StepCommand `cycle`. `reset` is the operator's, once.
    pub fn send(&mut self, cycle: u64, command: Option<&StepCommand>, reset: bool) -> Sent {
        self.pass_over_skipped(cycle);
        self.hear(command, reset);
        self.home_order = self.home_order.saturating_sub(1);
        let (guard, zero) = (self.guard, self.zero);
        let sensors = self.sensors();
        let output = if self.phase == Phase::Enabled {
            drive::step(&self.params.drive, &mut self.guard, cycle + 1, command, &sensors)
        } else {
            // It moves nothing, but it goes on hearing commands, and stands where the drive stands.
            let idle =
                command.map(|command| StepCommand { follow: 0, follow_id: 0, energise: 0, ..*command });
            self.guard.rebase(self.command_count(), false);
            drive::step(&self.params.drive, &mut self.guard, cycle + 1, idle.as_ref(), &sensors)
        };
        self.take_zero(command);
        let moved = Moved::new(output, &self.guard, self.zero);
        self.unconfirmed = Some(Unconfirmed { guard, zero, moved });
        let enabled = self.phase == Phase::Enabled;
        let target = if enabled { self.guard.accepted_microsteps() } else { self.command_count() };
        self.last_target = target;
        let control = self.control(cycle, self.guard.energised());
        Sent { outputs: self.outputs(control, target, output.pulse_rate_hz) }
    }

    /// Takes the outcome of cycle `cycle`: Feedback `cycle`, `None` where nothing is known of it.
    pub fn receive(&mut self, cycle: u64, exchange: &Exchange) -> Option<Feedback> {
        self.phase_correction_ns = exchange.phase_correction_ns;
        let verdict = self.judge.judge(exchange.outcome);
        if let Outcome::Answered { al_status, al_code, .. } = exchange.outcome {
            self.al = (al_status, al_code);
        }
        let inputs = exchange.inputs.filter(|_| verdict.good);
        let arrived = self.settle(inputs.is_some());
        if let Some(inputs) = inputs {
            self.note_inputs(inputs);
            self.note_state(cycle);
        }
        self.note_verdict(cycle, verdict);
        let known = inputs.is_some() || matches!(self.phase, Phase::Failed { .. });
        known.then(|| self.feedback(cycle, &arrived))
    }

    /// A cycle while the bus is being brought up: the command is heard, and Feedback says that no position is to be trusted and no
    /// current flows. A reset has no effect then.
    pub fn down(&mut self, cycle: u64, command: Option<&StepCommand>) -> Feedback {
        self.hear(command, false);
        self.unconfirmed = None;
        let arrived = self.settle(false);
        let feedback = self.feedback(cycle, &arrived);
        // Without a fault to tell, this one: nobody shall arm a drive that is not there.
        let fault = if feedback.drive_fault == 0 { FaultCode::BusLost.code() } else { feedback.drive_fault };
        Feedback { drive_fault: fault, ..feedback }
    }

    /// Process data of a drive that is let go where it stands.
    pub fn let_go(&self) -> Outputs {
        let control = if self.params.profile == Profile::El2522 { 0 } else { control::SHUTDOWN };
        self.outputs(control, self.last_target, 0.0)
    }

    /// The count of the position on the bus, in the valve's direction.
    fn count(&self) -> i64 {
        self.counter.map_or(0, |counter| counter.count())
    }

    /// The same as commands count, from the zero that the controller found.
    fn command_count(&self) -> i64 {
        self.count() + self.zero.microsteps
    }

    /// A zero that the guard took from the command: the bus goes on counting from its own.
    fn take_zero(&mut self, command: Option<&StepCommand>) {
        let Some(command) = command.filter(|_| self.guard.zero_id() != self.zero.id) else { return };
        self.zero = Zero {
            id: self.guard.zero_id(),
            microsteps: self.zero.microsteps + command.zero_shift_microsteps,
            encoder_rad: self.zero.encoder_rad + command.zero_shift_rad,
        };
        (self.found_zero, self.zero_in_doubt) = (true, false);
    }

    /// Cycles that did not run since the last one: to the drive they are frames that were lost.
    fn pass_over_skipped(&mut self, cycle: u64) {
        let skipped = self.last_cycle.map_or(0, |last| cycle.saturating_sub(last).saturating_sub(1));
        self.last_cycle = Some(cycle);
        for _ in 0..skipped.min(self.params.judge.bus_lost_cycles) {
            self.settle(false);
            let verdict = self.judge.judge(Outcome::Missing);
            self.note_verdict(cycle, verdict);
        }
    }

    fn note_verdict(&mut self, cycle: u64, verdict: Verdict) {
        if let Some(fault) = verdict.fault {
            self.bus_down |= !matches!(fault, BusFault::NotSynchronised { .. });
            self.fail(cycle, fault_code(fault));
        }
    }

    fn hear(&mut self, command: Option<&StepCommand>, reset: bool) {
        match command {
            Some(command) => {
                self.silent_cycles = 0;
                self.energise = command.energise == 1;
                self.zero_in_doubt |= command.zero_in_doubt == 1;
            }
            None => self.silent_cycles = self.silent_cycles.saturating_add(1),
        }
        if self.silent_cycles >= self.params.drive.silence_cycles && self.phase != Phase::Enabled {
            self.energise = false;
        }
        if reset {
            self.cia402.reset();
            self.release = true;
        }
        let wants_none = command.is_some_and(|command| command.energise == 0);
        // A drive that has not been heard yet may be in a fault.
        let heard = self.counter.is_some();
        let healthy = heard && !self.needs_bring_up() && !DriveState::of(self.inputs.status).faulty();
        match self.phase {
            Phase::Failed { .. } if (self.release || wants_none) && healthy => {
                (self.phase, self.fault) = (Phase::Off, FaultCode::None);
                self.judge.clear();
                self.release = false;
                // What the controller says from the next cycle on counts.
                self.energise = false;
            }
            Phase::Failed { .. } => {}
            _ if self.release => self.release = false,
            Phase::Off if self.energise && self.counter.is_some() => {
                let homes = std::mem::take(&mut self.home_order) > 0;
                self.phase = match homes {
                    true => Phase::Homing { cycles: 0, begun: 0 },
                    false => Phase::Enabling { cycles: 0 },
                };
            }
            Phase::Enabling { .. } | Phase::Homing { .. } if !self.energise => self.phase = Phase::Off,
            _ => {}
        }
    }

    fn control(&mut self, cycle: u64, guard_energised: bool) -> u16 {
        let order = match self.phase {
            Phase::Enabling { .. } | Phase::Homing { .. } => Order::On,
            Phase::Enabled if guard_energised => Order::On,
            // A drive that took the quick stop stands by then, and is off; one that ignores it loses its current.
            Phase::Failed { at_cycle } if cycle.saturating_sub(at_cycle) > self.ramp_cycles() => Order::Off,
            Phase::Failed { .. } => Order::QuickStop,
            Phase::Enabled | Phase::Off => Order::Off,
        };
        if self.params.profile == Profile::El2522 {
            // The terminal has one bit: go.
            return u16::from(order == Order::On);
        }
        if self.counter.is_none() {
            return control::SHUTDOWN;
        }
        let state = DriveState::of(self.inputs.status);
        let word = self.cia402.control(state, order);
        match &mut self.phase {
            Phase::Homing { begun, .. }
                if state == DriveState::OperationEnabled && self.inputs.mode == HOMING =>
            {
                *begun += 1;
                control::START_HOMING
            }
            _ => word,
        }
    }

    fn outputs(&self, control: u16, target: i64, pulse_rate_hz: f64) -> Outputs {
        let wire = self.counter.map_or(0, |counter| counter.to_wire(target - self.zero.microsteps));
        let enabled = self.phase == Phase::Enabled;
        let rate = if enabled { pulse_rate_hz * self.params.direction as f64 } else { 0.0 };
        Outputs {
            control,
            target: self.bus_sign(wire),
            mode: if matches!(self.phase, Phase::Homing { .. }) { HOMING } else { CSP },
            // `as` saturates.
            velocity_offset: rate.round() as i32,
        }
    }

    fn bus_sign(&self, wire: i32) -> i32 {
        if self.params.direction < 0 { wire.wrapping_neg() } else { wire }
    }

    /// Confirms this cycle's motion, or takes it back; gives the motion that ended at t_k.
    fn settle(&mut self, confirmed: bool) -> Moved {
        let [newer, arrived] = self.moved;
        let next = match self.unconfirmed.take() {
            Some(Unconfirmed { moved, .. }) if confirmed => moved,
            Some(Unconfirmed { guard, zero, moved }) => {
                (self.guard, self.zero) = (guard, zero);
                moved.not_done(guard.accepted_microsteps(), zero)
            }
            None => newer.not_done(newer.end(), newer.zero()),
        };
        self.moved = [next, newer];
        arrived
    }

    fn note_inputs(&mut self, inputs: Inputs) {
        let wire = self.bus_sign(inputs.position);
        match &mut self.counter {
            Some(counter) => _ = counter.follow(wire),
            None => self.begin_to_count(wire),
        }
        self.inputs = inputs;
    }

    /// From the position on the bus as it is.
    fn begin_to_count(&mut self, wire: i32) {
        let zero = match self.params.homing {
            Homing::Absolute { offset } => offset * self.params.direction,
            Homing::None | Homing::Drive { .. } => 0,
        };
        self.counter = Some(Counter::begin(wire, i64::from(wire) - zero));
        self.guard.rebase(self.command_count(), false);
        self.moved = [Moved::at_rest(self.command_count(), self.zero); 2];
    }

    /// A cycle in which the drive looks for its zero.
    fn note_homing(&mut self, cycle: u64, (cycles, begun): (u64, u64)) {
        let Inputs { status, mode, position, .. } = self.inputs;
        let told = mode == HOMING && begun > STALE_CYCLES;
        if told && status & HOMING_ERROR != 0 || cycles >= self.params.enable_cycles {
            return self.fail(cycle, FaultCode::Homing);
        }
        if told && status & ATTAINED == ATTAINED {
            // It counts from its new zero; so do we, and a zero of the controller's is of the past.
            self.zero = Zero { id: self.zero.id, ..Zero::default() };
            self.begin_to_count(self.bus_sign(position));
            (self.found_zero, self.zero_in_doubt) = (true, false);
            self.phase = Phase::Enabling { cycles: 0 };
            return;
        }
        self.phase = Phase::Homing { cycles: cycles + 1, begun };
    }

    fn note_state(&mut self, cycle: u64) {
        if self.params.profile == Profile::El2522 {
            if matches!(self.phase, Phase::Enabling { .. }) {
                self.enable();
            }
            return;
        }
        let state = DriveState::of(self.inputs.status);
        let follows = state == DriveState::OperationEnabled
            && self.inputs.mode == CSP
            && self.inputs.status & FOLLOWS != 0;
        match self.phase {
            Phase::Failed { .. } => {}
            _ if state.faulty() => self.fail(cycle, FaultCode::Drive),
            Phase::Homing { cycles, begun } => self.note_homing(cycle, (cycles, begun)),
            Phase::Enabling { .. } if follows => self.enable(),
            Phase::Enabling { cycles } if cycles >= self.params.enable_cycles => {
                self.fail(cycle, FaultCode::DriveLeftOperation);
            }
            Phase::Enabling { cycles } => self.phase = Phase::Enabling { cycles: cycles + 1 },
            // It was told to let go, and the guard stands.
            Phase::Enabled if !self.guard.energised() && !follows => self.phase = Phase::Off,
            Phase::Enabled if !follows => self.fail(cycle, FaultCode::DriveLeftOperation),
            Phase::Enabled | Phase::Off => {}
        }
    }

    /// From here on the guard leads, from where the drive was last told to be.
    fn enable(&mut self) {
        self.phase = Phase::Enabled;
        self.guard.rebase(self.last_target, true);
    }

    fn fail(&mut self, cycle: u64, fault: FaultCode) {
        if !matches!(self.phase, Phase::Failed { .. }) {
            self.phase = Phase::Failed { at_cycle: cycle };
            self.fault = fault;
            self.guard.rebase(self.guard.accepted_microsteps(), false);
        }
    }
}

fn fault_code(fault: BusFault) -> FaultCode {
    match fault {
        BusFault::Lost => FaultCode::BusLost,
        BusFault::LeftOperation { .. } => FaultCode::DriveLeftOperation,
        BusFault::NotSynchronised { .. } => FaultCode::NotSynchronised,
    }
}

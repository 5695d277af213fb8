//! A CiA 402 drive: its state machine, cyclic synchronous position, homing on the spot, and what it does in a fault.
//!
//! ```text
//!  switch-on disabled ─0x06▶ ready to switch on ─0x07▶ switched on ─0x0F▶ operation enabled ─0x02▶ quick stop active
//!        ▲ 0x80, rising              any fault ─▶ fault reaction active ─at rest▶ fault        │ at rest
//!        └────────────────────────────────────────────────────────────────┘◀──────────────────┘
//! ```

use crate::dictionary::Dictionary;
use crate::motion::Valve;
use crate::settings::{OnMissed, Settings};

/// The states, with the status word's bits under the mask 0x6F.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveState {
    /// Waits for 0x06.
    SwitchOnDisabled = 0x40,
    /// Waits for 0x07.
    ReadyToSwitchOn = 0x21,
    /// Waits for 0x0F.
    SwitchedOn = 0x23,
    /// Follows.
    OperationEnabled = 0x27,
    /// Ramps to a stop.
    QuickStopActive = 0x07,
    /// Ramps to a stop because of a fault.
    FaultReactionActive = 0x0F,
    /// Waits for a reset.
    Fault = 0x08,
}

const CSP: i64 = 8;
const HOMING: i64 = 6;
/// Emergency codes (CiA 402-2, table of 0x603F).
const FOLLOWING_ERROR: u16 = 0x8611;
const BUS: u16 = 0x8130;

/// A drive between two SYNC0 pulses.
#[derive(Debug, Clone)]
pub(crate) struct Cia402 {
    pub(crate) state: DriveState,
    /// Where the command stands, micro-steps, not wrapped.
    demand: i64,
    /// Where it comes from in this cycle.
    start: i64,
    /// What is added to a position to give what the bus carries: homing sets it.
    zero: i64,
    control_before: u16,
    mode: i64,
    cycles_in_state: u32,
    following_error_cycles: u32,
    fault: u16,
    homed: bool,
    /// Cycles for which bit 12 is withheld, and the mode display falsified.
    pub(crate) withhold_following: u32,
    pub(crate) false_mode: Option<(i64, u32)>,
}

impl Cia402 {
    pub(crate) fn new(settings: &Settings, valve: &Valve) -> Self {
        let demand = valve.microsteps();
        Self {
            state: DriveState::SwitchOnDisabled,
            demand,
            start: demand,
            zero: settings.zero_offset,
            control_before: 0,
            mode: 0,
            cycles_in_state: 0,
            following_error_cycles: 0,
            fault: 0,
            homed: false,
            withhold_following: 0,
            false_mode: None,
        }
    }

    /// Whether the windings carry current.
    pub(crate) fn energised(&self) -> bool {
        use DriveState::{FaultReactionActive, OperationEnabled, QuickStopActive, SwitchedOn};
        matches!(self.state, SwitchedOn | OperationEnabled | QuickStopActive | FaultReactionActive)
    }

    /// From where to where the command goes in the present cycle.
    pub(crate) fn motion(&self) -> (i64, i64) {
        (self.start, self.demand)
    }

    /// A fault of its own.
    pub(crate) fn fail(&mut self, code: u16) {
        if !matches!(self.state, DriveState::Fault | DriveState::FaultReactionActive) {
            self.fault = code;
            self.enter(DriveState::FaultReactionActive);
        }
    }

    /// The bus went away while it was to be followed: reacts as object 0x6007 says.
    pub(crate) fn bus_lost(&mut self, objects: &Dictionary) {
        if !self.energised() {
            return;
        }
        match objects.value(0x6007, 0) {
            0 => {}
            2 => self.enter(DriveState::SwitchOnDisabled),
            3 => self.enter(DriveState::QuickStopActive),
            _ => self.fail(BUS),
        }
    }

    /// SYNC0: takes the outputs, decides the cycle that begins, tells the inputs.
    pub(crate) fn sync(
        &mut self,
        objects: &mut Dictionary,
        valve: &Valve,
        settings: &Settings,
        fresh: bool,
        period_s: f64,
    ) {
        let actual = valve.microsteps();
        if !self.energised() {
            // Without current the counter follows the shaft.
            self.demand = actual;
            self.start = actual;
        }
        let arrived = self.demand;
        self.supervise(objects, arrived - actual, period_s);
        self.change_state(objects, settings);
        let way = self.demand - self.start;
        self.start = self.demand;
        self.demand += self.way(objects, settings, fresh, way, period_s);
        self.tell(objects, actual, arrived, settings);
    }

    fn enter(&mut self, state: DriveState) {
        if state != self.state {
            self.state = state;
            self.cycles_in_state = 0;
        }
    }

    /// Following error beyond 0x6065 for the time 0x6066, ms.
    fn supervise(&mut self, objects: &Dictionary, error: i64, period_s: f64) {
        let window = objects.unsigned(0x6065, 0);
        let outside = self.state == DriveState::OperationEnabled
            && window != u64::from(u32::MAX)
            && error.unsigned_abs() > window;
        self.following_error_cycles = if outside { self.following_error_cycles + 1 } else { 0 };
        if f64::from(self.following_error_cycles) * period_s * 1e3 > objects.unsigned(0x6066, 0) as f64 {
            self.fail(FOLLOWING_ERROR);
        }
    }

    fn change_state(&mut self, objects: &Dictionary, settings: &Settings) {
        use DriveState::{
            Fault, FaultReactionActive, OperationEnabled, QuickStopActive, ReadyToSwitchOn, SwitchOnDisabled,
            SwitchedOn,
        };
        let control = objects.unsigned(0x6040, 0) as u16;
        let reset = control & 0x80 != 0 && self.control_before & 0x80 == 0;
        self.control_before = control;
        self.mode = objects.value(0x6060, 0);
        self.cycles_in_state = self.cycles_in_state.saturating_add(1);
        let at_rest = self.demand == self.start;
        let (shutdown, on) = (control & 0x87 == 0x06, control & 0x87 == 0x07);
        let (enable, off) = (control & 0x8F == 0x0F, control & 0x82 == 0);
        let quick_stop = control & 0x86 == 0x02;
        let next = match self.state {
            SwitchOnDisabled if shutdown => ReadyToSwitchOn,
            ReadyToSwitchOn if on => SwitchedOn,
            SwitchedOn if enable && self.cycles_in_state > settings.enable_cycles => OperationEnabled,
            SwitchedOn if shutdown => ReadyToSwitchOn,
            ReadyToSwitchOn | SwitchedOn | OperationEnabled | QuickStopActive if off => SwitchOnDisabled,
            ReadyToSwitchOn | SwitchedOn if quick_stop => SwitchOnDisabled,
            OperationEnabled if quick_stop => QuickStopActive,
            OperationEnabled if shutdown && at_rest => ReadyToSwitchOn,
            OperationEnabled if on && !enable && at_rest => SwitchedOn,
            QuickStopActive if at_rest => SwitchOnDisabled,
            FaultReactionActive if at_rest => Fault,
            Fault if reset => {
                self.fault = 0;
                SwitchOnDisabled
            }
            same => same,
        };
        if next == OperationEnabled && self.state != OperationEnabled {
            self.following_error_cycles = 0;
        }
        self.enter(next);
    }

    /// How far the command goes in the cycle that begins.
    fn way(
        &mut self,
        objects: &Dictionary,
        settings: &Settings,
        fresh: bool,
        way: i64,
        period_s: f64,
    ) -> i64 {
        let enabled = self.state == DriveState::OperationEnabled;
        let stopping = objects.unsigned(0x6040, 0) & 0x0F != 0x0F;
        if enabled && self.mode == HOMING {
            self.home(objects);
            return 0;
        }
        if enabled && self.mode == CSP && !stopping && fresh {
            // The bus carries 32 bits: the nearer way round.
            let target = objects.value(0x607A, 0) as i32;
            let here = (self.demand + self.zero) as i32;
            let most = longest_way(objects, period_s);
            return i64::from(target.wrapping_sub(here)).clamp(-most, most);
        }
        if enabled && self.mode == CSP && !stopping && settings.on_missed == OnMissed::Extrapolate {
            return way;
        }
        if enabled && self.mode == CSP && !stopping {
            return 0;
        }
        // At 0x6085 to rest.
        let change = (objects.unsigned(0x6085, 0) as f64 * period_s * period_s).max(1.0) as i64;
        way.signum() * (way.abs() - change).max(0)
    }

    /// Homing methods 35 and 37: this place is the zero, apart from 0x607C.
    fn home(&mut self, objects: &Dictionary) {
        let start = objects.unsigned(0x6040, 0) & 0x10 != 0;
        let here = matches!(objects.value(0x6098, 0), 35 | 37);
        if start && here && !self.homed {
            self.zero = objects.value(0x607C, 0) - self.demand;
            self.homed = true;
        } else if !start {
            self.homed = false;
        }
    }

    fn tell(&mut self, objects: &mut Dictionary, actual: i64, arrived: i64, settings: &Settings) {
        let enabled = self.state == DriveState::OperationEnabled;
        let mut status = self.state as u16 | 0x0200 | if self.energised() { 0x10 } else { 0 };
        let withheld = self.withhold_following > 0;
        self.withhold_following = self.withhold_following.saturating_sub(1);
        let follows =
            enabled && self.mode == CSP && self.cycles_in_state > settings.follow_cycles && !withheld;
        let homed = enabled && self.mode == HOMING && self.homed;
        let refused =
            enabled && self.mode == HOMING && objects.unsigned(0x6040, 0) & 0x10 != 0 && !self.homed;
        for (bit, set) in [(1 << 12, follows || homed), (1 << 10, homed), (1 << 13, refused)] {
            status |= if set { bit } else { 0 };
        }
        let mode = match &mut self.false_mode {
            Some((mode, cycles)) if *cycles > 0 => {
                *cycles -= 1;
                *mode
            }
            _ => self.mode,
        };
        let position = if settings.position_is_measured { actual } else { arrived };
        objects.set(0x6041, 0, i64::from(status));
        objects.set(0x6064, 0, position + self.zero);
        objects.set(0x6062, 0, arrived + self.zero);
        objects.set(0x60F4, 0, arrived - position);
        objects.set(0x6061, 0, mode);
        objects.set(0x603F, 0, i64::from(self.fault));
    }
}

/// How far it turns in a cycle at the highest speed of its motor (0x6080, rpm).
fn longest_way(objects: &Dictionary, period_s: f64) -> i64 {
    let units_per_rev = objects.unsigned(0x6092, 1) as f64;
    // `as` saturates.
    (objects.unsigned(0x6080, 0) as f64 / 60.0 * units_per_rev * period_s).round() as i64
}

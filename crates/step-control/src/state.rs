//! What the controller remembers from cycle to cycle.

use crate::compensation::{Contact, Surroundings, Wanted};
use crate::correction::Correction;
use crate::partner::Partner;
use crate::recovery::Recovery;
use crate::shaper::Shaped;
use crate::tuning::Tuning;
use crate::way_back::WayBack;
use crate::window::Window;
use signals::{ControllerState, FaultCode, OperatorResult, Reference};

/// The controller's state between two cycles: plain data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// The newest cycle run; `None` before the first.
    pub(crate) last_cycle: Option<u64>,
    pub(crate) machine: ControllerState,
    pub(crate) fault: FaultCode,
    pub(crate) fault_cycle: u64,
    pub(crate) feedback: Partner,
    pub(crate) reference: Partner,
    pub(crate) window: Window,
    /// Cycles since the last reference that was heard of.
    pub(crate) unheard_cycles: u64,
    /// Whether this cycle's reference is further from the last one than any motion goes.
    pub(crate) leapt: bool,
    /// Whether the next target sets out from `led`, and does not go on from the reference before.
    pub(crate) sets_out: bool,
    pub(crate) way_back: WayBack,
    /// What was followed last: the reference, or what comes back to it.
    pub(crate) led: Reference,
    pub(crate) shaped: Shaped,
    /// The same, shaped: what the command aimed at.
    pub(crate) aim: Reference,
    /// The believed contact at the end of the cycle commanded last.
    pub(crate) contact: Contact,
    pub(crate) surroundings: Surroundings,
    pub(crate) wanted: Wanted,
    pub(crate) correction: Correction,
    pub(crate) recovery: Recovery,
    /// The encoder's reading of this cycle, rad, and its way since the one before, rad.
    pub(crate) reading_rad: Option<f64>,
    pub(crate) reading_way_rad: f64,
    /// Electrical lead of the command over the rotor at the last reading, lost teeth aside, rad.
    pub(crate) load_angle_rad: Option<f64>,
    /// Whether this cycle's reading says that steps are lost.
    pub(crate) lost: bool,
    /// How fast the trajectory's time shall run.
    pub(crate) time_scale: f64,
    /// Where the command stands at the end of the cycle commanded last, micro-steps, unrounded.
    pub(crate) position: f64,
    /// Its way in that cycle, micro-steps.
    pub(crate) travel: f64,
    /// Where it was wanted there, before limits, micro-steps.
    pub(crate) target: f64,
    /// The same a cycle earlier.
    pub(crate) target_before: f64,
    /// The driver's limits that held it back: bits of [`signals::limiting`].
    pub(crate) limits: u64,
    pub(crate) following_error_rad: f64,
    /// How far the reading is behind what the command aimed at for its time, rad.
    pub(crate) behind_aim_rad: f64,
    pub(crate) following_error_peak_rad: f64,
    pub(crate) tuning: Tuning,
    pub(crate) operator_id: u64,
    pub(crate) operator_result: OperatorResult,
}

impl State {
    /// A disarmed controller whose command stands at `position_microsteps`.
    pub fn new(position_microsteps: i64) -> Self {
        let position = position_microsteps as f64;
        Self {
            last_cycle: None,
            machine: ControllerState::Disarmed,
            fault: FaultCode::None,
            fault_cycle: 0,
            feedback: Partner::default(),
            reference: Partner::default(),
            window: Window::default(),
            unheard_cycles: 0,
            leapt: false,
            sets_out: false,
            way_back: WayBack::default(),
            led: Reference::default(),
            shaped: Shaped::default(),
            aim: Reference::default(),
            contact: Contact::relaxed(),
            surroundings: Surroundings::default(),
            wanted: Wanted::default(),
            correction: Correction::default(),
            recovery: Recovery::default(),
            reading_rad: None,
            reading_way_rad: 0.0,
            load_angle_rad: None,
            lost: false,
            time_scale: 1.0,
            position,
            travel: 0.0,
            target: position,
            target_before: position,
            limits: 0,
            following_error_rad: 0.0,
            behind_aim_rad: 0.0,
            following_error_peak_rad: 0.0,
            tuning: Tuning::default(),
            operator_id: 0,
            operator_result: OperatorResult::None,
        }
    }

    /// The state of the state machine.
    pub fn machine(&self) -> ControllerState {
        self.machine
    }

    /// Why the valve was stopped; kept until reset.
    pub fn fault(&self) -> FaultCode {
        self.fault
    }
}

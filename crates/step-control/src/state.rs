//! What the controller remembers from cycle to cycle, in parts by what they are for. Each says which files change it in a cycle; orders,
//! faults and gaps begin a part anew, by its one constructor (`supervise.rs`).

use crate::compensation::{Contact, FeedForward, Surroundings, Wanted, torque_beyond_nm};
use crate::correction::{Correction, Instant};
use crate::homing_state::HomingState;
use crate::params::Params;
use crate::partner::Partner;
use crate::recovery::Recovery;
use crate::reference::re_entry::ReEntry;
use crate::reference::shaper::Shaped;
use crate::reference::window::Window;
use crate::ringing::Ringing;
use crate::rotor::Seen;
use crate::tuning::Tuning;
use crate::watch::alarms::Alarms;
use crate::watch::benefit::Benefit;
use crate::watch::load_share::{Expected, LoadShare};
use drive::{Microsteps, MicrostepsPerCycle};
use serde::{Deserialize, Serialize};
use signals::{ControllerState, FaultCode, Feedback, Kinematics, OperatorResult, validity};

/// The controller's state between two cycles: plain data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct State {
    pub(crate) supervision: Supervision,
    pub(crate) reception: Reception,
    pub(crate) steering: Steering,
    pub(crate) observation: Observation,
    pub(crate) homing: HomingState,
    pub(crate) tuning: Tuning,
}

impl State {
    /// A disarmed controller whose command stands at `position_microsteps`.
    pub fn new(position_microsteps: i64) -> Self {
        Self {
            supervision: Supervision::default(),
            reception: Reception::default(),
            steering: Steering::at(position_microsteps.into(), Kinematics::default()),
            observation: Observation::default(),
            homing: HomingState::none(),
            tuning: Tuning::default(),
        }
    }

    /// The same, where steps were lost before and no zero was found since: the drive is told so.
    #[must_use]
    pub fn with_zero_in_doubt(mut self, zero_in_doubt: bool) -> Self {
        self.supervision.zero_in_doubt = zero_in_doubt;
        self
    }

    /// The state of the state machine.
    pub fn machine(&self) -> ControllerState {
        self.supervision.machine
    }

    /// The id of the last order handled.
    pub fn operator_id(&self) -> u64 {
        self.supervision.operator_id
    }

    /// Why the valve was stopped; kept until reset.
    pub fn fault(&self) -> FaultCode {
        self.supervision.fault
    }
}

/// The state machine and what it answered. Changed by `orders` and `supervise`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Supervision {
    pub machine: ControllerState,
    /// The cycle in which this state was entered.
    pub since_cycle: u64,
    /// Whether arming leads to homing instead of running.
    pub arms_to_home: bool,
    /// How often arming has ended with the drive holding: each time it is told once to begin to follow.
    pub armings: u64,
    pub fault: FaultCode,
    /// The cycle in which the fault was found.
    pub fault_cycle: u64,
    /// Steps were lost, and the drive still says that it is homed.
    pub zero_in_doubt: bool,
    /// The last order handled, by its id, and its result.
    pub operator_id: u64,
    pub operator_result: OperatorResult,
}

impl Default for Supervision {
    fn default() -> Self {
        Self {
            machine: ControllerState::Disarmed,
            since_cycle: 0,
            arms_to_home: false,
            armings: 0,
            fault: FaultCode::None,
            fault_cycle: 0,
            zero_in_doubt: false,
            operator_id: 0,
            operator_result: OperatorResult::None,
        }
    }
}

/// What has arrived from the partners. Changed by `reception`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Reception {
    /// The newest cycle run; `None` before the first.
    pub last_cycle: Option<u64>,
    pub feedback: Partner,
    pub reference: Partner,
    pub window: Window,
    /// Whether the newest Feedback said that the angle's zero is known.
    pub homed: bool,
    /// Cycles since the last reference that arrived.
    pub cycles_without_reference: u64,
    /// Whether this cycle's reference is further from the last one than any motion reaches.
    pub leapt: bool,
}

impl Reception {
    /// The same without the references that were missed before: arming begins with the reference of this cycle.
    pub(crate) fn begun(self) -> Self {
        Self { cycles_without_reference: 0, leapt: false, ..self }
    }
}

/// Where the command is and where it goes. Changed by `track`, by `step` while the valve is stopped, by `homing` on its way, and by `reception`
/// where the drive's zero has moved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Steering {
    /// Whether a re-entry ramp starts at `led` in the next cycle.
    pub re_enters: bool,
    pub re_entry: ReEntry,
    /// What was followed last: the reference, or the re-entry ramp towards it.
    pub led: Kinematics,
    pub shaped: Shaped,
    /// `led`, shaped: what the command aimed at.
    pub aim: Kinematics,
    /// The believed contact at the end of the cycle commanded last.
    pub contact: Contact,
    /// The part of the believed friction that is fed forward while it moves.
    pub fed_part: f64,
    /// The friction that was fed in the cycle before, N·m, where cycles are long.
    pub friction_before_nm: f64,
    /// Factor on the feed-forward, 1 to 0, while it decays: at rest with lightly damped bristles, and for good after compensation did harm.
    pub fading: f64,
    /// The ringing that long cycles excite, and whether the belief's friction state is still valid.
    pub ringing: Ringing,
    pub contact_known: bool,
    pub wanted: Wanted,
    /// How fast the trajectory's time shall run.
    pub time_scale: f64,
    /// The encoder's angle minus the angle of the drive's count, rad: zero for a homed valve.
    pub offset_rad: f64,
    /// The command's position at the end of the cycle commanded last.
    pub position: Microsteps,
    /// Its motion in that cycle.
    pub travel: MicrostepsPerCycle,
    /// Its target there, before the driver's limits.
    pub target: Microsteps,
    /// The same a cycle earlier.
    pub target_before: Microsteps,
    /// The limits that held it back: bits of [`signals::limiting`].
    pub limits: u64,
}

impl Steering {
    /// At rest on a reference, the command at a position, the believed bristles relaxed.
    pub(crate) fn at(position: Microsteps, reference: Kinematics) -> Self {
        Self {
            re_enters: false,
            re_entry: ReEntry::default(),
            led: reference,
            shaped: Shaped::at(reference),
            aim: reference,
            contact: Contact::relaxed(),
            fed_part: 1.0,
            friction_before_nm: 0.0,
            fading: 1.0,
            ringing: Ringing::default(),
            contact_known: true,
            wanted: Wanted::default(),
            time_scale: 1.0,
            offset_rad: 0.0,
            position,
            travel: MicrostepsPerCycle::ZERO,
            target: position,
            target_before: position,
            limits: 0,
        }
    }
}

impl Steering {
    /// The angle of a command at `position`, in the encoder's frame, rad.
    pub(crate) fn angle_rad(&self, params: &Params, position: Microsteps) -> f64 {
        position.0 * params.drive.microstep_angle_rad + self.offset_rad
    }

    /// The position of a command at an angle in the encoder's frame.
    pub(crate) fn position_of(&self, params: &Params, angle_rad: f64) -> Microsteps {
        Microsteps((angle_rad - self.offset_rad) / params.drive.microstep_angle_rad)
    }
}

/// What the sensors say, and what follows from it. Changed by `measure`, by `track` for what it commands, and by `reception`, `acceptance`
/// and `orders` for what the drive accepted and which peaks and alarms an order takes back.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Observation {
    pub surroundings: Surroundings,
    pub correction: Correction,
    pub recovery: Recovery,
    /// The encoder's reading of this cycle, rad, and its change since the one before, rad.
    pub reading_rad: Option<f64>,
    pub reading_change_rad: f64,
    /// The rotor's motion by the encoder, for the limit of the load angle.
    pub seen: Option<Seen>,
    /// Electrical lead of the command over the rotor at the last reading, lost teeth aside, rad.
    pub load_angle_rad: Option<f64>,
    pub alarms: Alarms,
    /// The share of the believed friction that the valve has.
    pub load_share: LoadShare,
    /// Whether compensation makes the error smaller.
    pub benefit: Benefit,
    /// Commands since arming that did not reach the drive in time.
    pub missed_commands: u64,
    /// Whether this cycle's reading says that steps are lost.
    pub lost: bool,
    pub following_error_rad: f64,
    /// What the command aimed at for the time of the reading, minus the reading, rad.
    pub behind_aim_rad: f64,
    pub following_error_peak_rad: f64,
}

impl Observation {
    /// Begins with a valve at rest: friction balances the torque that its command gives.
    pub(crate) fn begun(self, params: &Params, steering: &Steering, feedback: &Feedback) -> Self {
        let command_rad = steering.angle_rad(params, steering.position);
        let seen = feedback.validity & validity::ENCODER != 0;
        let lag_rad = f64::from(params.motor.rotor_teeth) * (command_rad - feedback.angle_rad);
        let beyond_nm = torque_beyond_nm(params, command_rad, &steering.led, &FeedForward::default());
        let instant = Instant {
            reference_rad: steering.led.angle_rad,
            beyond_nm,
            command_rad,
            expected: Expected::default(),
        };
        Self {
            surroundings: self.surroundings,
            correction: Correction::at_rest(instant),
            recovery: Recovery::begin(if seen { lag_rad } else { 0.0 }),
            ..Self::default()
        }
    }
}

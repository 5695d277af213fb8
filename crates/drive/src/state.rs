//! What the guard remembers from cycle to cycle.

use crate::{Microsteps, MicrostepsPerCycle};
use signals::FaultCode;

/// What the guard is doing; the drawing stands in the crate's documentation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Nothing is asked for: ramps to a stop and stays.
    Idle,
    /// Follows the commands within the limits.
    Following,
    /// The commands fell silent or made no sense, or the valve left its limits: ramps to a stop and stays, latched.
    StoppedItself,
    /// The latch is off; waits for a command that stands where the drive stands.
    Released,
}

/// The guard's state between two cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Where the command stands, before rounding.
    pub(crate) position: Microsteps,
    /// Where the motor is driven to: whole micro-steps.
    pub(crate) accepted: i64,
    /// Way of the last cycle.
    pub(crate) travel: MicrostepsPerCycle,
    /// Cycles in a row without a command.
    pub(crate) missed: u64,
    /// What the drive is doing.
    pub(crate) mode: Mode,
    /// Whether a stop by itself is over: the ramp, and the way to the neutral position where there is one.
    pub(crate) settled: bool,
    /// Whether the windings carry current.
    pub(crate) energised: bool,
    /// Whether the last command wanted current.
    pub(crate) energise_wanted: bool,
    /// Position that the last cycle's command asked for; `None` when it had none to follow.
    pub(crate) previous_command: Option<Microsteps>,
    /// The cycle of the newest command taken.
    pub(crate) command_cycle: u64,
    /// Whether the newest command was refused for its jump.
    pub(crate) refused: bool,
    /// Why it stopped by itself.
    pub(crate) fault: FaultCode,
    /// Cycles for which current has been asked for.
    pub(crate) energising_cycles: u64,
    /// The part of the rated current that the last command wanted.
    pub(crate) current_ratio: f64,
    /// The newest zero taken, and what all of them added to the count, micro-steps.
    pub(crate) zero_id: u64,
    pub(crate) rebased: i64,
    /// Where the encoder has rested, rad, and for how many cycles.
    pub(crate) rests_at_rad: Option<f64>,
    pub(crate) rested_cycles: u64,
}

impl State {
    /// A drive at rest, its windings without current, that has seen no command.
    pub fn at_rest(accepted_microsteps: i64) -> Self {
        Self {
            position: accepted_microsteps.into(),
            accepted: accepted_microsteps,
            travel: MicrostepsPerCycle::ZERO,
            missed: 0,
            mode: Mode::Idle,
            settled: true,
            energised: false,
            energise_wanted: false,
            previous_command: None,
            command_cycle: 0,
            refused: false,
            fault: FaultCode::None,
            energising_cycles: 0,
            current_ratio: 1.0,
            zero_id: 0,
            rebased: 0,
            rests_at_rad: None,
            rested_cycles: u64::MAX,
        }
    }

    /// The same with the windings carrying current from the start.
    pub fn at_rest_energised(accepted_microsteps: i64) -> Self {
        Self { energised: true, energise_wanted: true, ..Self::at_rest(accepted_microsteps) }
    }

    /// Stands elsewhere, at rest, with or without current: for a drive whose position is told by its bus. The mode stays.
    pub fn rebase(&mut self, accepted_microsteps: i64, energised: bool) {
        *self = Self {
            mode: self.mode,
            missed: self.missed,
            command_cycle: self.command_cycle,
            // A zero is taken once.
            zero_id: self.zero_id,
            energised,
            ..Self::at_rest(accepted_microsteps)
        };
    }

    /// The same with a zero that was shifted before: the count is `rebased_microsteps` beyond the motor's own.
    #[must_use]
    pub fn with_zero(self, zero_id: u64, rebased_microsteps: i64) -> Self {
        Self { zero_id, rebased: rebased_microsteps, ..self }
    }

    /// The newest zero taken from a command; 0 before the first.
    pub fn zero_id(&self) -> u64 {
        self.zero_id
    }

    /// How far the count is beyond the motor's own, which fixes the phase of the current, micro-steps.
    pub fn rebased_microsteps(&self) -> i64 {
        self.rebased
    }

    /// Where the command stands now, in whole micro-steps (Feedback's `accepted_microsteps`).
    pub fn accepted_microsteps(&self) -> i64 {
        self.accepted
    }

    /// Where the command stands now, before rounding.
    pub fn position_unrounded(&self) -> Microsteps {
        self.position
    }

    /// The cycle of the newest command taken (Feedback's `command_cycle`); 0 before the first.
    pub fn command_cycle(&self) -> u64 {
        self.command_cycle
    }

    /// What the drive is doing.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Cycles in a row without a command.
    pub fn missed_cycles(&self) -> u64 {
        self.missed
    }

    /// Whether the windings carry current.
    pub fn energised(&self) -> bool {
        self.energised
    }
}

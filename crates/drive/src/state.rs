//! What the guard remembers from cycle to cycle.

use crate::{Microsteps, MicrostepsPerCycle};

/// What the guard is doing; the drawing stands in the crate's documentation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Nothing is asked for: ramps to a stop and stays.
    Idle,
    /// Follows the commands within the limits.
    Following,
    /// The commands fell silent: ramps to a stop and stays, latched.
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
        }
    }

    /// The same with the windings carrying current from the start.
    pub fn at_rest_energised(accepted_microsteps: i64) -> Self {
        Self { energised: true, energise_wanted: true, ..Self::at_rest(accepted_microsteps) }
    }

    /// Stands elsewhere, at rest, with or without current: for a drive whose position is told by its bus. The mode stays.
    pub fn rebase(&mut self, accepted_microsteps: i64, energised: bool) {
        let (mode, missed, command_cycle) = (self.mode, self.missed, self.command_cycle);
        *self = Self { mode, missed, command_cycle, energised, ..Self::at_rest(accepted_microsteps) };
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

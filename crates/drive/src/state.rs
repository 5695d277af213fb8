//! The guard's state between two cycles.

use crate::{Microsteps, MicrostepsPerCycle};
use signals::FaultCode;

/// What the guard is doing; the drawing stands in the crate's documentation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// No command to follow: ramps to a stop and holds.
    Idle,
    /// Follows the commands, within the limits.
    Following,
    /// Commands were missing or implausible, or the valve left its limits of angle: ramps to a stop, latched.
    StoppedItself,
    /// The latch is released; waits for a command at the drive's own position.
    Released,
}

/// Where the commands lead: a missing one is continued from here at constant rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Continuation {
    /// Position at the end of the last cycle.
    pub(crate) position: Microsteps,
    /// Travel in that cycle, by the command's own pulse rate.
    pub(crate) way: MicrostepsPerCycle,
}

/// The guard's state between two cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Position of the command, before rounding.
    pub(crate) position: Microsteps,
    /// Position given to the motor: whole micro-steps.
    pub(crate) accepted: i64,
    /// Travel of the last cycle.
    pub(crate) travel: MicrostepsPerCycle,
    /// Consecutive cycles without a command.
    pub(crate) missed: u64,
    /// The mode.
    pub(crate) mode: Mode,
    /// Whether a stop by itself is complete, including the move to the neutral position where there is one.
    pub(crate) settled: bool,
    /// Whether the windings carry current.
    pub(crate) energised: bool,
    /// Whether the last command asked for current.
    pub(crate) energise_wanted: bool,
    /// What the last cycle's command asked for, or the continuation of the one before; `None` if there is none to follow.
    pub(crate) course: Option<Continuation>,
    /// Cycle of the newest command accepted.
    pub(crate) command_cycle: u64,
    /// The arming under which the drive followed last; 0 before the first.
    pub(crate) follow_id: u64,
    /// Whether the newest command was refused because it jumped or contradicts itself.
    pub(crate) refused: bool,
    /// Reason of the last stop by itself.
    pub(crate) fault: FaultCode,
    /// Consecutive cycles in which current was asked for.
    pub(crate) energising_cycles: u64,
    /// Part of the rated current that the last command asked for.
    pub(crate) current_ratio: f64,
    /// Id of the newest zero shift applied, and the sum of all shifts, micro-steps.
    pub(crate) zero_id: u64,
    pub(crate) rebased: i64,
    /// Angle at which the encoder rests, rad, and for how many cycles it has.
    pub(crate) rests_at_rad: Option<f64>,
    pub(crate) rested_cycles: u64,
}

impl State {
    /// A drive at rest without current that has not received a command.
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
            course: None,
            command_cycle: 0,
            follow_id: 0,
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

    /// The same with current from the start.
    pub fn at_rest_energised(accepted_microsteps: i64) -> Self {
        Self { energised: true, energise_wanted: true, ..Self::at_rest(accepted_microsteps) }
    }

    /// Sets the position at rest, with or without current: for a drive whose position is read from its bus. The mode stays.
    pub fn rebase(&mut self, accepted_microsteps: i64, energised: bool) {
        *self = Self {
            mode: self.mode,
            missed: self.missed,
            command_cycle: self.command_cycle,
            // Each zero shift is applied once, and each arming begins once.
            zero_id: self.zero_id,
            follow_id: self.follow_id,
            energised,
            ..Self::at_rest(accepted_microsteps)
        };
    }

    /// The same with a zero shifted earlier: the count is `rebased_microsteps` ahead of the motor's own.
    #[must_use]
    pub fn with_zero(self, zero_id: u64, rebased_microsteps: i64) -> Self {
        Self { zero_id, rebased: rebased_microsteps, ..self }
    }

    /// Id of the newest zero shift applied; 0 before the first.
    pub fn zero_id(&self) -> u64 {
        self.zero_id
    }

    /// Count minus the motor's own count, which defines the phase of the current, micro-steps.
    pub fn rebased_microsteps(&self) -> i64 {
        self.rebased
    }

    /// Position of the command, whole micro-steps (Feedback's `accepted_microsteps`).
    pub fn accepted_microsteps(&self) -> i64 {
        self.accepted
    }

    /// Position of the command before rounding.
    pub fn position_unrounded(&self) -> Microsteps {
        self.position
    }

    /// Cycle of the newest command accepted (Feedback's `command_cycle`); 0 before the first.
    pub fn command_cycle(&self) -> u64 {
        self.command_cycle
    }

    /// The mode.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Consecutive cycles without a command.
    pub fn missed_cycles(&self) -> u64 {
        self.missed
    }

    /// Whether the windings carry current.
    pub fn energised(&self) -> bool {
        self.energised
    }
}

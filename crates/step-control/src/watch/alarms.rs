//! Alarms: what the operator has to know, but what does not stop the valve. Kept until the next arming.

use crate::params::Params;
use crate::watch::load_share::LoadShare;
use crate::watch::oscillation::Oscillation;
use serde::{Deserialize, Serialize};
use signals::alarm;

/// The observer may be at its limit for this long before it is an alarm, s: longer than any reversal or break-away takes.
const SATURATED_S: f64 = 1.0;

/// The alarm's threshold for lost commands. Each command that arrives takes back half of a lost one, so the alarm needs more
/// than a third lost.
const LOST_COMMANDS: f64 = 5.0;
const ARRIVED: f64 = 0.5;

/// What leads to alarms, and those raised.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Alarms {
    oscillation: Oscillation,
    saturated_cycles: u64,
    /// Commands lost, less those that arrived since by their weight.
    lost_commands: f64,
    raised: u64,
    /// Whether compensation is given up.
    gave_up: bool,
}

impl Alarms {
    /// Takes in a reading's deviation from its aim, rad, and whether the observer is at its limit.
    pub(crate) fn step(&mut self, params: &Params, deviation_rad: f64, saturated: bool) {
        self.saturated_cycles = if saturated { self.saturated_cycles.saturating_add(1) } else { 0 };
        if self.saturated_cycles as f64 * params.period_s > SATURATED_S {
            self.raised |= alarm::OBSERVER_SATURATED;
        }
        if self.oscillation.step(params, deviation_rad) {
            self.raised |= if self.slowed() { alarm::OBSERVER_OFF } else { alarm::OSCILLATION };
            self.oscillation = Oscillation::default();
        }
    }

    /// Takes in whether the drive had its command in time.
    pub(crate) fn note_command(&mut self, missed: bool) {
        self.lost_commands = (self.lost_commands + if missed { 1.0 } else { -ARRIVED }).max(0.0);
        if self.lost_commands > LOST_COMMANDS {
            self.raised |= alarm::COMMANDS_LOST;
        }
    }

    /// Takes in which share of the believed friction the valve has.
    pub(crate) fn note_share(&mut self, share: &LoadShare) {
        if share.below_belief() {
            self.raised |= alarm::LOAD_BELOW_BELIEF;
        }
        if share.above_belief() {
            self.raised |= alarm::LOAD_ABOVE_BELIEF;
        }
        if share.other_inertia() {
            self.raised |= alarm::INERTIA;
        }
    }

    /// Compensation makes the error larger.
    pub(crate) fn note_harm(&mut self) {
        self.raised |= alarm::NO_BENEFIT;
        self.gave_up = true;
    }

    /// Another compensation was ordered: it is judged anew.
    pub(crate) fn try_again(&mut self) {
        self.gave_up = false;
    }

    /// Whether nothing is compensated any more.
    pub(crate) fn gave_up(&self) -> bool {
        self.gave_up
    }

    /// Whether the observer shall trust the belief less.
    pub(crate) fn slowed(&self) -> bool {
        self.raised & (alarm::OSCILLATION | alarm::INERTIA) != 0
    }

    /// Bits of [`signals::alarm`].
    pub(crate) fn raised(&self) -> u64 {
        self.raised
    }

    /// Whether only the feed-forward is left.
    pub(crate) fn fell_back(&self) -> bool {
        self.gave_up || self.raised & (alarm::OBSERVER_OFF | alarm::COMMANDS_LOST) != 0
    }
}

//! The motions wanted from the present cycle to the one that is commanded.

use serde::{Deserialize, Serialize};
use signals::{Kinematics, Reference};

/// References k, k+1 and k+2 during cycle k. A missing one is continued at constant speed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Window {
    now: Kinematics,
    next: Kinematics,
    newest: Kinematics,
}

impl Window {
    /// Moves on by one cycle; `reference` is the one of two cycles ahead.
    pub(crate) fn shift(&mut self, reference: Option<&Reference>, period_s: f64) {
        self.now = self.next;
        self.next = self.newest;
        self.newest = reference.map_or_else(|| self.continued(period_s), Reference::kinematics);
    }

    /// Fills the window with one reference: at the start, where nothing moved before.
    pub(crate) fn fill(&mut self, reference: Kinematics) {
        *self = Self { now: reference, next: reference, newest: reference };
    }

    /// Reference k.
    pub(crate) fn now(&self) -> &Kinematics {
        &self.now
    }

    /// How far the next reference is from the newest one's extrapolation, rad.
    pub(crate) fn leap_rad(&self, next: &Reference, period_s: f64) -> f64 {
        next.angle_rad - self.continued(period_s).angle_rad
    }

    /// The motion wanted at the end of the commanded cycle: Reference k+2, or one cycle further for a loop with one
    /// cycle more of delay, continued at its jerk.
    pub(crate) fn commanded(&self, loop_delay_cycles: u64, period_s: f64) -> Kinematics {
        if loop_delay_cycles <= 1 { self.newest } else { self.newest.after(period_s) }
    }

    /// The newest one extrapolated by a cycle, at constant speed.
    fn continued(&self, period_s: f64) -> Kinematics {
        self.newest.at_constant_speed().after(period_s)
    }
}

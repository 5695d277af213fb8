//! The references from the present cycle to the one that is commanded.

use signals::Reference;

/// Reference k, k+1 and k+2 during cycle k. A missing one is continued at constant speed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Window {
    now: Reference,
    next: Reference,
    newest: Reference,
}

impl Window {
    /// Moves on by one cycle; `reference` is the one of two cycles ahead.
    pub(crate) fn shift(&mut self, reference: Option<&Reference>, period_s: f64) {
        self.now = self.next;
        self.next = self.newest;
        self.newest = reference.copied().unwrap_or_else(|| continued(&self.newest, period_s));
    }

    /// Fills the window with one reference: at the start, where nothing moved before.
    pub(crate) fn fill(&mut self, reference: &Reference) {
        *self = Self { now: *reference, next: *reference, newest: *reference };
    }

    /// Reference k.
    pub(crate) fn now(&self) -> &Reference {
        &self.now
    }

    /// How far the next reference is from where the newest one leads, rad.
    pub(crate) fn leap_rad(&self, next: &Reference, period_s: f64) -> f64 {
        next.angle_rad - continued(&self.newest, period_s).angle_rad
    }

    /// The motion wanted at the end of the commanded cycle: Reference k+2, or one cycle further for a loop with one
    /// cycle more of delay, continued at its jerk.
    pub(crate) fn commanded(&self, loop_delay_cycles: u64, period_s: f64) -> Reference {
        if loop_delay_cycles <= 1 { self.newest } else { advanced(&self.newest, period_s) }
    }
}

fn continued(last: &Reference, dt_s: f64) -> Reference {
    Reference {
        angle_rad: last.angle_rad + last.speed_rad_per_s * dt_s,
        acceleration_rad_per_s2: 0.0,
        jerk_rad_per_s3: 0.0,
        ..*last
    }
}

fn advanced(last: &Reference, dt_s: f64) -> Reference {
    let (speed, acceleration, jerk) =
        (last.speed_rad_per_s, last.acceleration_rad_per_s2, last.jerk_rad_per_s3);
    Reference {
        angle_rad: last.angle_rad + dt_s * (speed + dt_s * (acceleration / 2.0 + dt_s * jerk / 6.0)),
        speed_rad_per_s: speed + dt_s * (acceleration + dt_s * jerk / 2.0),
        acceleration_rad_per_s2: acceleration + dt_s * jerk,
        ..*last
    }
}

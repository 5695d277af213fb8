//! Input shaping: the reference in two halves, half a period of the resonance apart, so that what the first sets
//! ringing the second stops (zero vibration). It costs a delay of a quarter of the period.

use serde::{Deserialize, Serialize};
use signals::Reference;
use std::f64::consts::PI;

/// References remembered: half a period at the slowest resonance and shortest cycle that are shaped.
const MEMORY: usize = 64;

/// A shaper, designed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Shaper {
    /// Whole cycles and the rest, in s, by which the second half comes later.
    cycles: usize,
    rest_s: f64,
    /// The first half's part.
    first: f64,
}

impl Shaper {
    /// For a resonance of these angular frequency and damping ratio; `None` if half its period is longer than what is
    /// remembered, or the resonance is none.
    pub(crate) fn design(frequency_rad_per_s: f64, damping_ratio: f64, period_s: f64) -> Option<Self> {
        if damping_ratio >= 1.0 {
            return None;
        }
        let damped = (1.0 - damping_ratio * damping_ratio).sqrt();
        let half_s = PI / (frequency_rad_per_s * damped);
        let cycles = (half_s / period_s).ceil();
        if cycles >= MEMORY as f64 {
            return None;
        }
        let decay = (-damping_ratio * PI / damped).exp();
        Some(Self { cycles: cycles as usize, rest_s: cycles * period_s - half_s, first: 1.0 / (1.0 + decay) })
    }
}

/// The references that a shaper remembers, newest first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shaped {
    past: [Reference; MEMORY],
}

impl Default for Shaped {
    fn default() -> Self {
        Self { past: [Reference::default(); MEMORY] }
    }
}

impl Shaped {
    /// Begins at rest.
    pub(crate) fn fill(&mut self, reference: &Reference) {
        self.past = [*reference; MEMORY];
    }

    /// Begins anew on a motion at the speed of `shaped`, which is what comes out; what goes in.
    pub(crate) fn restart(&mut self, shaper: &Shaper, shaped: &Reference, period_s: f64) -> Reference {
        let speed = shaped.speed_rad_per_s;
        let late_s = (1.0 - shaper.first) * (shaper.cycles as f64 * period_s - shaper.rest_s);
        let line = Reference { acceleration_rad_per_s2: 0.0, jerk_rad_per_s3: 0.0, ..*shaped };
        let at = |age: u8| shaped.angle_rad + speed * (late_s - period_s * f64::from(age));
        for (past, age) in self.past.iter_mut().zip(0..) {
            *past = Reference { angle_rad: at(age), ..line };
        }
        Reference { angle_rad: at(0), ..line }
    }

    /// Takes the newest reference in and gives the shaped one.
    pub(crate) fn step(&mut self, shaper: &Shaper, newest: &Reference) -> Reference {
        self.past.rotate_right(1);
        if let Some(first) = self.past.first_mut() {
            *first = *newest;
        }
        let old = self.past.get(shaper.cycles).unwrap_or(newest);
        let late = later(old, shaper.rest_s);
        let mix = |first: f64, second: f64| second + shaper.first * (first - second);
        Reference {
            angle_rad: mix(newest.angle_rad, late.angle_rad),
            speed_rad_per_s: mix(newest.speed_rad_per_s, late.speed_rad_per_s),
            acceleration_rad_per_s2: mix(newest.acceleration_rad_per_s2, late.acceleration_rad_per_s2),
            ..*newest
        }
    }
}

/// A motion continued at its jerk for less than a cycle.
fn later(reference: &Reference, dt_s: f64) -> Reference {
    let (speed, acceleration, jerk) =
        (reference.speed_rad_per_s, reference.acceleration_rad_per_s2, reference.jerk_rad_per_s3);
    Reference {
        angle_rad: reference.angle_rad + dt_s * (speed + dt_s * (acceleration / 2.0 + dt_s * jerk / 6.0)),
        speed_rad_per_s: speed + dt_s * (acceleration + dt_s * jerk / 2.0),
        acceleration_rad_per_s2: acceleration + dt_s * jerk,
        ..*reference
    }
}

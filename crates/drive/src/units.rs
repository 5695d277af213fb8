//! Position and travel in micro-steps as two types, so that they cannot be confused.

use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Sub};

/// A position of the command, absolute micro-steps, before rounding.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Microsteps(pub f64);

/// Travel in one cycle, signed, micro-steps: pulse rate times period.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct MicrostepsPerCycle(pub f64);

impl Microsteps {
    /// The nearest whole micro-step.
    pub fn round(self) -> i64 {
        self.0.round() as i64
    }
}

impl MicrostepsPerCycle {
    /// No motion.
    pub const ZERO: Self = Self(0.0);

    /// The pulse rate, Hz, for cycles of this length.
    pub fn rate_hz(self, period_s: f64) -> f64 {
        self.0 / period_s
    }
}

impl From<i64> for Microsteps {
    fn from(count: i64) -> Self {
        Self(count as f64)
    }
}

impl Add<MicrostepsPerCycle> for Microsteps {
    type Output = Self;

    fn add(self, way: MicrostepsPerCycle) -> Self {
        Self(self.0 + way.0)
    }
}

impl AddAssign<MicrostepsPerCycle> for Microsteps {
    fn add_assign(&mut self, way: MicrostepsPerCycle) {
        *self = *self + way;
    }
}

impl Sub for Microsteps {
    type Output = MicrostepsPerCycle;

    /// The travel from `from` to this position.
    fn sub(self, from: Self) -> MicrostepsPerCycle {
        MicrostepsPerCycle(self.0 - from.0)
    }
}

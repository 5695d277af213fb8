//! Input shaping: the reference in two parts, half a period of the resonance apart, so that the second cancels the ringing that
//! the first excites (zero vibration). It costs a delay of a quarter of the period.

use serde::{Deserialize, Serialize};
use signals::Kinematics;
use std::f64::consts::PI;

/// Motions remembered: half a period at the slowest resonance and shortest cycle that are shaped.
const MEMORY: usize = 64;

/// A shaper, designed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Shaper {
    /// Delay of the second part: whole cycles, less the rest in s.
    cycles: usize,
    rest_s: f64,
    /// The first part's weight.
    first: f64,
}

impl Shaper {
    /// For a resonance of this angular frequency and damping ratio; `None` if half its period is longer than what is
    /// remembered, or the resonance is overdamped.
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

/// The motions that a shaper remembers, newest first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Shaped {
    #[serde(with = "serde_big_array::BigArray")]
    past: [Kinematics; MEMORY],
}

impl Shaped {
    /// At rest.
    pub(crate) fn at(reference: Kinematics) -> Self {
        Self { past: [reference; MEMORY] }
    }

    /// Restarts so that `shaped` comes out, at its speed; returns the input that belongs to it.
    pub(crate) fn restart(&mut self, shaper: &Shaper, shaped: &Kinematics, period_s: f64) -> Kinematics {
        let line = shaped.at_constant_speed();
        let late_s = (1.0 - shaper.first) * (shaper.cycles as f64 * period_s - shaper.rest_s);
        let at = |age: u8| {
            let angle_rad = line.angle_rad + line.speed_rad_per_s * (late_s - period_s * f64::from(age));
            Kinematics { angle_rad, ..line }
        };
        for (past, age) in self.past.iter_mut().zip(0..) {
            *past = at(age);
        }
        at(0)
    }

    /// Takes the newest motion in and gives the shaped one.
    pub(crate) fn step(&mut self, shaper: &Shaper, newest: &Kinematics) -> Kinematics {
        self.past.rotate_right(1);
        if let Some(first) = self.past.first_mut() {
            *first = *newest;
        }
        let late = self.past.get(shaper.cycles).unwrap_or(newest).after(shaper.rest_s);
        let mix = |first: f64, second: f64| second + shaper.first * (first - second);
        Kinematics {
            angle_rad: mix(newest.angle_rad, late.angle_rad),
            speed_rad_per_s: mix(newest.speed_rad_per_s, late.speed_rad_per_s),
            acceleration_rad_per_s2: mix(newest.acceleration_rad_per_s2, late.acceleration_rad_per_s2),
            ..*newest
        }
    }
}

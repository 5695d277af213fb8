//! A value with its first and second derivative by time, so that a motion's speed and acceleration are exact.

use std::ops::{Add, Mul};

/// Value, rate and second derivative.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Jet {
    pub value: f64,
    pub rate: f64,
    pub second: f64,
}

impl Jet {
    pub fn constant(value: f64) -> Self {
        Self { value, ..Self::default() }
    }

    /// The sine of 2π·f·t + φ.
    pub fn tone(frequency_hz: f64, phase_rad: f64, time_s: f64) -> Self {
        let w = std::f64::consts::TAU * frequency_hz;
        let (sin, cos) = (w * time_s + phase_rad).sin_cos();
        Self { value: sin, rate: w * cos, second: -w * w * sin }
    }

    /// From 0 to 1 between `from_s` and `from_s + length_s`, with two continuous derivatives.
    pub fn rise(from_s: f64, length_s: f64, time_s: f64) -> Self {
        let x = ((time_s - from_s) / length_s).clamp(0.0, 1.0);
        let (x2, x3) = (x * x, x * x * x);
        Self {
            value: x3 * (10.0 - 15.0 * x + 6.0 * x2),
            rate: 30.0 * x2 * (1.0 - 2.0 * x + x2) / length_s,
            second: 60.0 * x * (1.0 - 3.0 * x + 2.0 * x2) / (length_s * length_s),
        }
    }

    /// An angle whose speed changes from 0 to `speed` as [`Self::rise`] does.
    pub fn ramp(speed: f64, from_s: f64, length_s: f64, time_s: f64) -> Self {
        let x = (time_s - from_s) / length_s;
        let rise = Self::rise(from_s, length_s, time_s);
        let area = match x {
            x if x <= 0.0 => 0.0,
            x if x < 1.0 => x.powi(4) * (2.5 - 3.0 * x + x * x),
            x => x - 0.5,
        };
        Self { value: speed * length_s * area, rate: speed * rise.value, second: speed * rise.rate }
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            rate: self.rate + other.rate,
            second: self.second + other.second,
        }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            rate: self.rate * other.value + self.value * other.rate,
            second: self.second * other.value + 2.0 * self.rate * other.rate + self.value * other.second,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_value() {
        let h = 1e-5;
        let all = |t: f64| {
            Jet::rise(0.1, 0.3, t) * (Jet::tone(3.0, 0.4, t) + Jet::constant(0.2))
                + Jet::ramp(2.0, 0.2, 0.1, t)
        };
        for t in [0.13, 0.22, 0.27, 0.36, 0.5] {
            let (before, here, after) = (all(t - h), all(t), all(t + h));
            assert!(((after.value - before.value) / (2.0 * h) - here.rate).abs() < 1e-5);
            assert!(((after.rate - before.rate) / (2.0 * h) - here.second).abs() < 1e-3);
        }
    }
}

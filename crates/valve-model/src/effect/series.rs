//! A Fourier series over an angle, without a mean: Σ_k cos[k]·cos kα + sin[k]·sin kα, k from 1 on.

use serde::{Deserialize, Serialize};

use super::table::MAX_HARMONICS;

/// The coefficients, zero beyond `count`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Series {
    count: usize,
    cos: [f64; MAX_HARMONICS],
    sin: [f64; MAX_HARMONICS],
}

impl Series {
    /// `None` where every coefficient is zero.
    pub fn new(cos: &[f64], sin: &[f64]) -> Option<Self> {
        let fill = |values: &[f64]| {
            let mut filled = [0.0; MAX_HARMONICS];
            for (slot, value) in filled.iter_mut().zip(values) {
                *slot = *value;
            }
            filled
        };
        let any = cos.iter().chain(sin).any(|value| *value != 0.0);
        let count = cos.len().max(sin.len()).min(MAX_HARMONICS);
        any.then(|| Self { count, cos: fill(cos), sin: fill(sin) })
    }

    /// self + factor·other
    pub fn plus(mut self, factor: f64, other: &Self) -> Self {
        self.count = self.count.max(other.count);
        for (slot, value) in self.cos.iter_mut().zip(&other.cos) {
            *slot += factor * value;
        }
        for (slot, value) in self.sin.iter_mut().zip(&other.sin) {
            *slot += factor * value;
        }
        self
    }

    /// factor·self
    pub fn times(mut self, factor: f64) -> Self {
        for slot in self.cos.iter_mut().chain(&mut self.sin) {
            *slot *= factor;
        }
        self
    }

    /// The sum and its derivative by the angle (rad).
    pub fn at(&self, angle: f64) -> (f64, f64) {
        let (sin_one, cos_one) = angle.sin_cos();
        let (mut sin, mut cos) = (sin_one, cos_one);
        let (mut value, mut slope) = (0.0, 0.0);
        let mut order = 1.0;
        for (a, b) in self.cos.iter().zip(&self.sin).take(self.count) {
            value += a * cos + b * sin;
            slope += order * (b * cos - a * sin);
            (sin, cos) = (sin * cos_one + cos * sin_one, cos * cos_one - sin * sin_one);
            order += 1.0;
        }
        (value, slope)
    }
}

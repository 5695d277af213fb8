//! A Fourier series over an angle, without a mean: Σ_k cos[k]·cos kα + sin[k]·sin kα, k from 1 on.
//!
//! Orders reach high (a motor's slots turn 36 times as often as its shaft) and few of them are there, so that only those are kept.

use serde::{Deserialize, Serialize};

use super::table::MAX_TERMS;

/// One order of a series.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Term {
    order: f64,
    cos: f64,
    sin: f64,
}

/// The orders that are there, ascending.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Series {
    count: usize,
    terms: [Term; MAX_TERMS],
}

impl Series {
    /// `None` where every coefficient is zero. Beyond [`MAX_TERMS`] orders, which no model has, the highest are left out.
    pub fn new(cos: &[f64], sin: &[f64]) -> Option<Self> {
        let at = |values: &[f64], index: usize| values.get(index).copied().unwrap_or(0.0);
        let all = (0..cos.len().max(sin.len())).map(|index| {
            let order = index as f64 + 1.0;
            Term { order, cos: at(cos, index), sin: at(sin, index) }
        });
        let mut found = Self { count: 0, terms: [Term::default(); MAX_TERMS] };
        let there = all.filter(|term| term.cos != 0.0 || term.sin != 0.0);
        for (slot, term) in found.terms.iter_mut().zip(there) {
            *slot = term;
            found.count += 1;
        }
        (found.count > 0).then_some(found)
    }

    /// The sum and its derivative by the angle (rad).
    pub fn at(&self, angle: f64) -> (f64, f64) {
        let (sin_one, cos_one) = angle.sin_cos();
        let (mut sin, mut cos) = (0.0, 1.0);
        let (mut value, mut slope) = (0.0, 0.0);
        let mut before = 0.0;
        for Term { order, cos: a, sin: b } in self.terms.iter().take(self.count) {
            (sin, cos) = if *order == before + 1.0 {
                (sin * cos_one + cos * sin_one, cos * cos_one - sin * sin_one)
            } else {
                (order * angle).sin_cos()
            };
            value += a * cos + b * sin;
            slope += order * (b * cos - a * sin);
            before = *order;
        }
        (value, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_summed_wherever_they_lie() {
        let (mut cos, mut sin) = (vec![0.0; 128], vec![0.0; 40]);
        for (order, a, b) in
            [(1, 0.5, 0.1), (2, 0.0, -0.3), (7, 0.2, 0.0), (36, -0.4, 0.25), (128, 0.05, 0.0)]
        {
            cos.iter_mut().skip(order - 1).take(1).for_each(|slot| *slot = a);
            sin.iter_mut().skip(order - 1).take(1).for_each(|slot| *slot = b);
        }
        let plain = |angle: f64| -> f64 {
            let part = |(index, a): (usize, &f64)| a * ((index + 1) as f64 * angle).cos();
            let other = |(index, b): (usize, &f64)| b * ((index + 1) as f64 * angle).sin();
            cos.iter().enumerate().map(part).sum::<f64>() + sin.iter().enumerate().map(other).sum::<f64>()
        };
        let Some(series) = Series::new(&cos, &sin) else { panic!("nothing there") };
        for step in -20..20 {
            let angle = 0.37 * f64::from(step);
            let (value, slope) = series.at(angle);
            assert!((value - plain(angle)).abs() < 1e-12, "{value} {}", plain(angle));
            let secant = (plain(angle + 1e-6) - plain(angle - 1e-6)) / 2e-6;
            assert!((slope - secant).abs() < 1e-5, "{slope} {secant}");
        }
        assert!(Series::new(&[0.0; 3], &[]).is_none());
    }
}

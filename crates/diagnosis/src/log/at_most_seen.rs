//! Bounds the variance that the measured motion adds to a prediction by what the residual shows of it.
//!
//! The motion's part is computed: the encoder's error by a second measurement, the unknown motion between samples from every second sample. Both
//! may be too large, the second by the square of 3 where the motion is smooth between samples and the method's order is 2. A residual contains the
//! error that the prediction has, so that its squares bound it, whatever else it contains. Stretches of about the same computed variance are taken
//! together; the upper end of the 95 % interval of their mean square, in parts of that variance, is the bound. A median would be none: where
//! bristles turn over within a step, few stretches have nearly all of the error.

use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::statistics::Statistics;
use std::collections::BTreeMap;
use std::ops::Range;

/// Stretches whose variances are within this factor are taken together.
const ALIKE: f64 = 4.0;
/// Probability below the upper end of a 95 % interval.
const UPPER: f64 = 0.975;

/// A piece's residual, the variances computed for it, and the stretches within which its errors are the same.
pub(crate) struct Seen<'a> {
    pub residual: &'a [f64],
    pub variances: &'a mut Vec<f64>,
    pub stretches: Vec<Range<usize>>,
}

/// Lowers what the variances have beyond the channel's own to what the residual can contain of it.
pub(crate) fn at_most_seen(pieces: &mut [Seen<'_>], channel: f64) {
    let mut ratios: BTreeMap<i32, Vec<f64>> = BTreeMap::new();
    for stretch in pieces.iter().flat_map(Seen::each) {
        if let Some(class) = class(stretch.variance, channel) {
            ratios.entry(class).or_default().push(stretch.square / stretch.variance);
        }
    }
    let bounds: BTreeMap<i32, f64> =
        ratios.into_iter().filter_map(|(class, ratios)| Some((class, upper_mean(&ratios)?))).collect();
    for piece in pieces {
        for stretch in piece.each() {
            let bound = class(stretch.variance, channel).and_then(|class| bounds.get(&class));
            let Some(bound) = bound.filter(|bound| **bound < 1.0) else { continue };
            let beyond = stretch.variance - channel;
            let part = ((bound * stretch.variance - channel) / beyond).max(0.0);
            for variance in piece.variances.get_mut(stretch.rows).into_iter().flatten() {
                *variance = channel + part * (*variance - channel).max(0.0);
            }
        }
    }
}

/// The mean variance and squared residual of a stretch.
struct Stretch {
    rows: Range<usize>,
    variance: f64,
    square: f64,
}

impl Seen<'_> {
    fn each(&self) -> Vec<Stretch> {
        let one = |rows: &Range<usize>| {
            let mean = |values: &mut dyn Iterator<Item = f64>| {
                let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
                sum / count
            };
            let residual = self.residual.get(rows.clone())?;
            let variance = mean(&mut self.variances.get(rows.clone())?.iter().copied());
            let square =
                mean(&mut residual.iter().filter(|value| value.is_finite()).map(|value| value * value));
            square.is_finite().then_some(Stretch { rows: rows.clone(), variance, square })
        };
        self.stretches.iter().filter_map(one).collect()
    }
}

/// The class of a variance; none where most of it is the channel's own.
fn class(variance: f64, channel: f64) -> Option<i32> {
    let over = variance / channel;
    (over.is_finite() && over > 2.0).then(|| over.log(ALIKE).floor() as i32)
}

/// The upper end of a mean's 95 % interval, by Student's t.
fn upper_mean(values: &[f64]) -> Option<f64> {
    let freedom = values.len() as f64 - 1.0;
    let quantile = StudentsT::new(0.0, 1.0, freedom).ok()?.inverse_cdf(UPPER);
    Some(values.mean() + quantile * values.std_dev() / (freedom + 1.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::prelude::*;
    use rand_distr::StandardNormal;

    /// Residuals of rests of 20 samples each: the channel's noise of variance 1, and an error of the variance `true_beyond` that each rest has for
    /// itself. The variances are said to be 1 + `beyond`; what is made of them.
    fn bounded((beyond, true_beyond): (f64, f64), rests: usize) -> Vec<f64> {
        let mut generator = rand_pcg::Pcg64::seed_from_u64(rests as u64);
        let mut normal = || -> f64 { StandardNormal.sample(&mut generator) };
        let residual: Vec<f64> = (0..rests)
            .flat_map(|_| {
                let shared = normal() * true_beyond.sqrt();
                (0..20).map(|_| shared + normal()).collect::<Vec<f64>>()
            })
            .collect();
        let mut variances = vec![1.0 + beyond; residual.len()];
        let stretches = (0..rests).map(|rest| 20 * rest..20 * (rest + 1)).collect();
        at_most_seen(&mut [Seen { residual: &residual, variances: &mut variances, stretches }], 1.0);
        variances
    }

    #[test]
    fn variances_that_are_right_or_too_small_stay() {
        for (beyond, true_beyond) in [(100.0, 100.0), (20.0, 100.0), (0.5, 0.0)] {
            let found = bounded((beyond, true_beyond), 60);
            assert!(found.iter().all(|of| *of == 1.0 + beyond), "{beyond} of {true_beyond}: {}", found[0]);
        }
    }

    #[test]
    fn variances_that_are_too_large_go_to_what_is_seen() {
        let found = bounded((400.0, 25.0), 200)[0];
        assert!((25.0..80.0).contains(&found), "{found}");
        // Without any, the channel's own is left, within the factor by which a median of means is a bound.
        let found = bounded((400.0, 0.0), 200)[0];
        assert!((1.0..3.0).contains(&found), "{found}");
    }

    #[test]
    fn one_rest_bounds_nothing() {
        assert!(bounded((400.0, 0.0), 1).iter().all(|of| *of == 401.0));
    }

    /// Where one rest of many has all of the error, the mean square shows it.
    #[test]
    fn an_error_that_few_rests_have_is_left() {
        let residual: Vec<f64> =
            (0..64).flat_map(|rest| [if rest % 16 == 0 { 40.0 } else { 1.0 }; 20]).collect();
        let mut variances = vec![101.0; residual.len()];
        let stretches = (0..64).map(|rest| 20 * rest..20 * (rest + 1)).collect();
        at_most_seen(&mut [Seen { residual: &residual, variances: &mut variances, stretches }], 1.0);
        assert!(variances.iter().all(|of| *of == 101.0), "{}", variances[0]);
    }
}

//! Effective sample size: an encoder that stays within one step repeats the same quantisation error.
//!
//! The error of a sample has a part of its own and a part that it shares with its neighbours, as long as the encoder
//! stays within a step. The mean of n samples with a shared variance b and one of their own s has the variance b +
//! s/n, that of (b + s)/(b + s/n) samples with independent errors. Each of them therefore counts as (b + s)/(n·b + s)
//! of an independent sample.

use prediction::Noise;
use std::f64::consts::PI;
use std::ops::Range;

/// Terms of the rounding error's series: the third is below a thousandth of the first wherever noise matters.
const TERMS: u32 = 3;

/// The variance, rad², of an encoder's mean error over a rest in which noise moves the reading from step to step. It is the
/// rounding error's Fourier series over the angle, each term damped by the noise (Widrow and Kollár, Quantization Noise, 2008).
pub(crate) fn rest_variance(noise: Noise) -> f64 {
    let step = noise.step_rad;
    if step <= 0.0 {
        return 0.0;
    }
    let spread = 2.0 * PI * noise.beyond_quantisation_rad() / step;
    let term = |order: u32| {
        let order = f64::from(order);
        0.5 * (step / (PI * order)).powi(2) * (-(order * spread).powi(2)).exp()
    };
    // Without noise the series sums up to a step's variance.
    let all: f64 = (1..=TERMS).map(term).sum();
    if spread < 0.1 { step * step / 12.0 } else { all }
}

/// Stretches within which an angle stays within `reach_rad` of where it was at their beginning.
pub(crate) fn stretches(angles: impl Iterator<Item = f64>, reach_rad: f64) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    let mut began_rad = f64::NAN;
    for (index, angle) in angles.enumerate() {
        match found.last_mut().filter(|_| (angle - began_rad).abs() <= reach_rad) {
            Some(stretch) => stretch.end = index + 1,
            None => {
                began_rad = angle;
                found.push(index..index + 1);
            }
        }
    }
    found
}

/// Neighbours joined until each has at least so many samples; one that has them already stays by itself.
pub(crate) fn of_at_least(samples: usize, stretches: Vec<Range<usize>>) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for stretch in stretches {
        match found.last_mut().filter(|last| last.len() < samples && stretch.len() < samples) {
            Some(last) => last.end = stretch.end,
            None => found.push(stretch),
        }
    }
    found
}

/// The part of an independent sample that each of `count` samples counts as. They share an error of variance `shared`, and each
/// has one of variance `own` of its own.
pub(crate) fn information(shared: f64, own: f64, count: usize) -> f64 {
    let all = shared + own;
    if all > 0.0 { all / (count as f64 * shared + own) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_that_share_their_error_count_as_one() {
        assert!((100.0 * information(1.0, 0.0, 100) - 1.0).abs() < 1e-12);
        assert!((information(0.0, 1.0, 100) - 1.0).abs() < 1e-12);
        let half = 100.0 * information(1.0, 1.0, 100);
        assert!((half - 2.0 / 1.01).abs() < 1e-12, "{half}");
    }

    #[test]
    fn noise_of_half_a_step_makes_rounding_white() {
        let of = |noise: f64| {
            let deviation_rad = (1.0f64 / 12.0 + noise * noise).sqrt();
            rest_variance(Noise { deviation_rad, step_rad: 1.0 }) * 12.0
        };
        assert!((of(0.0) - 1.0).abs() < 1e-9);
        assert!((0.4..0.7).contains(&of(0.1)), "{}", of(0.1));
        assert!(of(0.5) < 0.01, "{}", of(0.5));
    }

    #[test]
    fn a_stretch_ends_where_the_angle_leaves_its_step() {
        let angles = [0.0, 0.1, 0.05, 1.0, 2.0, 2.1, 2.0];
        assert_eq!(stretches(angles.into_iter(), 0.2), [0..3, 3..4, 4..7]);
    }

    #[test]
    fn short_stretches_are_joined_and_long_ones_are_not() {
        assert_eq!(of_at_least(3, vec![0..1, 1..2, 2..4, 4..9, 9..10, 10..11]), [0..4, 4..9, 9..11]);
    }
}

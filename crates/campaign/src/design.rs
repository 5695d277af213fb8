//! Which points a design tries: each a number from 0 to 1 for each quantity that is varied.
//!
//! A point follows from seed and number alone. A Latin hypercube draws one permutation a quantity; a Sobol sequence is
//! scrambled after Owen, in Burley's manner (Practical Hash-based Owen Scrambling, JCGT 9(4), 2020), with directions of Joe and Kuo.

use config::DesignKind;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// What a stream of random numbers is for, so that no two are the same.
#[derive(Clone, Copy)]
enum Stream {
    Point = 1,
    Permutation = 2,
    Scramble = 3,
}

/// The points of a design that is no grid.
#[derive(Debug, Clone)]
pub(crate) struct Points {
    kind: DesignKind,
    seed: u64,
    /// Of a Latin hypercube: the step of each point, quantity by quantity.
    steps: Vec<Vec<u32>>,
    scrambling: u32,
}

impl Points {
    /// So many points of so many quantities.
    pub(crate) fn new(kind: DesignKind, seed: u64, points: u64, quantities: usize) -> Self {
        let steps = match kind {
            DesignKind::LatinHypercube => {
                (0..quantities as u64).map(|quantity| permutation(seed, quantity, points)).collect()
            }
            _ => Vec::new(),
        };
        Self { kind, seed, steps, scrambling: mixed(seed, Stream::Scramble, 0) as u32 }
    }

    /// The coordinates of a point, each above 0 and below 1.
    pub(crate) fn at(&self, point: u64, quantities: usize) -> Vec<f64> {
        let mut draws = Pcg64::seed_from_u64(mixed(self.seed, Stream::Point, point));
        let coordinate = |quantity: usize| {
            // Drawn in any case, so that a quantity's number doesn't depend on the kind of another.
            let drawn: f64 = draws.random();
            match self.kind {
                DesignKind::Sobol => {
                    f64::from(sobol_burley::sample(point as u32, quantity as u32, self.scrambling))
                }
                DesignKind::LatinHypercube => {
                    let steps = self.steps.get(quantity).map(Vec::as_slice).unwrap_or_default();
                    let step = steps.get(point as usize).copied().unwrap_or_default();
                    (f64::from(step) + drawn) / steps.len().max(1) as f64
                }
                DesignKind::Random | DesignKind::Grid => drawn,
            }
        };
        // A normal distribution has no value at 0 and 1.
        (0..quantities)
            .map(coordinate)
            .map(|unit: f64| unit.clamp(f64::EPSILON, 1.0 - f64::EPSILON))
            .collect()
    }
}

fn permutation(seed: u64, quantity: u64, points: u64) -> Vec<u32> {
    let mut steps: Vec<u32> = (0..points as u32).collect();
    steps.shuffle(&mut Pcg64::seed_from_u64(mixed(seed, Stream::Permutation, quantity)));
    steps
}

/// A seed of its own for each number of each stream: SplitMix64's output function over both.
fn mixed(seed: u64, stream: Stream, number: u64) -> u64 {
    let scattered = |value: u64| {
        let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        value ^ (value >> 31)
    };
    scattered(scattered(scattered(seed) ^ stream as u64) ^ number)
}

/// The levels of a grid's point, the last quantity's changing fastest.
pub(crate) fn grid_levels(point: u64, sizes: &[u64]) -> Vec<u64> {
    let mut rest = point;
    let mut levels: Vec<u64> = sizes
        .iter()
        .rev()
        .map(|size| {
            let level = rest % size.max(&1);
            rest /= size.max(&1);
            level
        })
        .collect();
    levels.reverse();
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(kind: DesignKind, seed: u64, points: u64, quantities: usize) -> Vec<Vec<f64>> {
        let design = Points::new(kind, seed, points, quantities);
        (0..points).map(|point| design.at(point, quantities)).collect()
    }

    #[test]
    fn a_latin_hypercube_has_each_step_once() {
        let points = all(DesignKind::LatinHypercube, 5, 100, 3);
        for quantity in 0..3 {
            let mut steps: Vec<u64> = points.iter().map(|point| (point[quantity] * 100.0) as u64).collect();
            steps.sort_unstable();
            assert_eq!(steps, (0..100).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_sobol_sequence_is_even_in_every_pair() {
        // 256 points: one in each of 256 boxes of 16 by 16 is what a (0, 8, 2)-net has; the first two quantities are one.
        let points = all(DesignKind::Sobol, 9, 256, 6);
        let mut boxes: Vec<u32> =
            points.iter().map(|point| (point[0] * 16.0) as u32 * 16 + (point[1] * 16.0) as u32).collect();
        boxes.sort_unstable();
        assert_eq!(boxes, (0..256).collect::<Vec<_>>());
        for quantity in 0..6 {
            let mean = points.iter().map(|point| point[quantity]).sum::<f64>() / 256.0;
            assert!((mean - 0.5).abs() < 2e-3, "{mean}");
        }
    }

    #[test]
    fn points_follow_from_seed_and_number() {
        for kind in [DesignKind::LatinHypercube, DesignKind::Sobol, DesignKind::Random] {
            let first = all(kind, 1, 50, 4);
            assert_eq!(first, all(kind, 1, 50, 4));
            assert_ne!(first, all(kind, 2, 50, 4));
            let inside = first.iter().flatten().all(|unit| (0.0..1.0).contains(unit) && *unit > 0.0);
            assert!(inside);
        }
        // A random design may be made longer; its first points stay.
        assert_eq!(all(DesignKind::Random, 1, 50, 4)[..20], all(DesignKind::Random, 1, 20, 4)[..]);
    }

    #[test]
    fn a_grid_has_every_combination() {
        let levels: Vec<Vec<u64>> = (0..6).map(|point| grid_levels(point, &[2, 3])).collect();
        assert_eq!(levels, [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2]]);
        assert!(grid_levels(0, &[]).is_empty());
    }
}

//! Whether a residual repeats itself: takes the same course over the time since the run's beginning in every run. Noise never does.

use crate::fit::equations::Setting;
use crate::numerics::line::{Line, Weighted};
use crate::numerics::statistics::{CHANCE, SHARE_LEFT};
use crate::show::residual::PieceResidual;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use std::collections::BTreeMap;

/// Stretches of the time in the run, with about as many samples each.
const STRETCHES: usize = 12;
/// Runs at least. Of fewer, what they have in common may be what each has by itself.
const LEAST_RUNS: usize = 4;
/// Degrees of freedom of a line.
const OF_LINE: f64 = 2.0;

/// A residual's mean in a stretch of a run.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    /// The sum of the samples' information, of their times with this weight, and of their residuals relative to the noise.
    weight: f64,
    time: f64,
    residual: f64,
}

/// By run and stretch.
type Cells = BTreeMap<usize, BTreeMap<usize, Cell>>;

/// Whether the runs' residuals have so much in common, over the time since each run's beginning, that it is not by chance.
pub(crate) fn is_repeated(setting: &Setting<'_>, left: &[PieceResidual]) -> bool {
    let mut samples: Vec<(usize, f64, f64, f64)> = Vec::new();
    for (piece, left) in setting.campaign.pieces.iter().zip(left) {
        let weights = piece.weights.iter().zip(&piece.information);
        let values = piece.driven.time_s().iter().zip(&left.residual).zip(weights);
        for ((time_s, residual), (weight, information)) in values.filter(|(_, (weight, _))| **weight > 0.0) {
            samples.push((piece.run, time_s - piece.begins_s, residual * weight, *information));
        }
    }
    let square: f64 = samples.iter().map(|(_, _, residual, _)| residual * residual).sum();
    let cells = cells(&mut samples);
    cells.len() >= LEAST_RUNS
        && in_common(&cells)
            .is_some_and(|(explained, p_value)| p_value < CHANCE && explained > SHARE_LEFT * square)
}

/// Samples (run, time since its beginning, residual relative to the noise, information) by run and stretch.
fn cells(samples: &mut [(usize, f64, f64, f64)]) -> Cells {
    samples.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut cells = Cells::new();
    let size = samples.len().div_ceil(STRETCHES).max(1);
    for (stretch, samples) in samples.chunks(size).enumerate() {
        for (run, time_s, residual, information) in samples {
            let cell = cells.entry(*run).or_default().entry(stretch).or_default();
            cell.weight += information;
            cell.time += information * time_s;
            cell.residual += information.sqrt() * residual;
        }
    }
    cells
}

/// The sum of squares that the stretches' means over all runs account for beyond chance, and its p-value: the F test of the stretches against
/// their scatter between runs, which is as large as the noise's colour makes it. Each run's zero and drift are taken off before. `None` where
/// the runs share too little.
fn in_common(cells: &Cells) -> Option<(f64, f64)> {
    let (mut stretches, mut all, mut count): (BTreeMap<usize, (f64, f64)>, f64, f64) = Default::default();
    for run in cells.values() {
        let point = |cell: &Cell| Weighted {
            weight: cell.weight,
            x: cell.time / cell.weight,
            y: cell.residual / cell.weight,
        };
        let points: Vec<Weighted> = run.values().map(point).collect();
        let Some(line) = Line::through(&points) else { continue };
        for (stretch, point) in run.keys().zip(&points) {
            let beside = point.y - line.at(point.x);
            let sums = stretches.entry(*stretch).or_default();
            *sums = (sums.0 + point.weight, sums.1 + point.weight * beside);
            all += point.weight * beside * beside;
        }
        count += points.len() as f64 - OF_LINE;
    }
    let between: f64 = stretches.values().map(|(weight, sum)| sum * sum / weight).sum();
    let of_stretches = stretches.len() as f64 - OF_LINE;
    let others = count - of_stretches;
    let within = (all - between) / others;
    let p_value = 1.0 - FisherSnedecor::new(of_stretches, others).ok()?.cdf(between / of_stretches / within);
    Some((between - of_stretches * within, p_value))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64Mcg;

    /// Eight runs with noise of a memory of so many samples, a drift each, and what all have in common.
    fn runs(seed: u64, memory: f64, common: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut drawn = || StandardNormal.sample(&mut random);
        let keeps: f64 = (-1.0 / memory).exp();
        let mut samples = Vec::new();
        for run in 0..8 {
            let (drift, mut noise): (f64, f64) = (drawn(), 0.0);
            for index in 0..1000 {
                let time = 1e-3 * f64::from(index);
                let new: f64 = drawn();
                noise = keeps * noise + (1.0 - keeps * keeps).sqrt() * new;
                samples.push((run, time, noise + drift * time + common(time), 1.0));
            }
        }
        in_common(&cells(&mut samples))
    }

    #[test]
    fn coloured_noise_does_not_repeat_and_a_transient_does() {
        let wrongly = (0..200).filter(|seed| runs(*seed, 20.0, |_| 0.0).unwrap().1 < CHANCE).count();
        assert!(wrongly <= 8, "{wrongly} of 200 by chance, with one in a hundred wanted");
        for seed in 0..20 {
            let (explained, p_value) = runs(seed, 20.0, |time| 4.0 * (-time / 0.1).exp()).unwrap();
            assert!(p_value < CHANCE && explained > 0.02 * 8000.0, "seed {seed}: {explained} {p_value}");
        }
    }
}

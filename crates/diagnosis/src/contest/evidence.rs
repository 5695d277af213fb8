//! What one run would say for each contender against each other.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use super::{Contender, Contest};
use crate::extend::hypothesis::Free;
use crate::numerics::gram::{Gram, invert};
use log_data::Run;
use nalgebra::DMatrix;
use prediction::{Past, predict, predicted_channel};

/// Two contenders, by their places, and the log Bayes factor between them.
pub(crate) type Pair = (usize, usize, f64);

/// A run's equations for each ordered pair of contenders: the columns are the second one's sensitivities, the last one is the
/// first one's prediction less the second one's. In standard deviations of the measurement.
#[derive(Debug, Clone)]
pub(crate) struct Evidence {
    pairs: Vec<(usize, usize, Gram)>,
}

impl Evidence {
    /// What no run says.
    pub fn none(contest: &Contest) -> Self {
        let width = |contender: &Contender| contender.hypothesis.free().len();
        let pairs = ordered(contest)
            .map(|(truth, other)| (truth, other, Gram::zero(contest.contenders.get(other).map_or(0, width))));
        Self { pairs: pairs.collect() }
    }

    /// What a run would say; `None` where a contender can't predict it.
    pub fn of(contest: &Contest, run: &Run) -> Option<Self> {
        let each: Vec<Predictions> = contest
            .contenders
            .iter()
            .map(|contender| Predictions::of(contest, contender, run))
            .collect::<Option<_>>()?;
        let pairs = ordered(contest).map(|(truth, other)| {
            let (at_truth, at_other) = (&each[truth].base, &each[other]);
            let distance = at_truth.iter().zip(&at_other.base).map(|(truth, other)| truth - other);
            (truth, other, gram(contest, &at_other.columns, distance.collect()))
        });
        Some(Self { pairs: pairs.collect() })
    }

    /// The same from so many times as many samples.
    pub fn times(mut self, times: f64) -> Self {
        self.pairs.iter_mut().for_each(|(.., gram)| *gram = gram.times(times));
        self
    }

    /// Both together.
    pub fn and(&self, more: &Self) -> Self {
        let mut sum = self.clone();
        for ((.., gram), (.., more)) in sum.pairs.iter_mut().zip(&more.pairs) {
            gram.add(more);
        }
        sum
    }

    /// The expected log Bayes factor of each pair, each of them true in turn: the lesser of the two.
    pub fn by_pair(&self, contest: &Contest) -> Vec<Pair> {
        let mut found: Vec<Pair> = Vec::new();
        for (truth, other, gram) in &self.pairs {
            let says = 0.5 * left(gram, &contest.contenders[*other].covariance);
            match found.iter_mut().find(|(one, two, _)| (one, two) == (other, truth)) {
                Some((.., least)) => *least = least.min(says),
                None => found.push((*truth, *other, says)),
            }
        }
        found
    }
}

fn ordered(contest: &Contest) -> impl Iterator<Item = (usize, usize)> + use<> {
    let count = contest.contenders.len();
    (0..count).flat_map(move |truth| {
        (0..count).filter(move |other| *other != truth).map(move |other| (truth, other))
    })
}

/// A contender's prediction of a run, and its sensitivities.
struct Predictions {
    base: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl Predictions {
    fn of(contest: &Contest, contender: &Contender, run: &Run) -> Option<Self> {
        let hypothesis = &contender.hypothesis;
        let predicted = |hypothesis: &crate::extend::hypothesis::Hypothesis| {
            let mut run = run.clone();
            let channel = predicted_channel(&run).ok()?;
            let model = hypothesis.model(&contest.given).ok()?;
            let past = Past { rest_s: 0.0, distance_rad: contest.distance_rad };
            predict(&mut run, &model, &past).ok()?;
            run.take_channel(channel)
        };
        let base = predicted(hypothesis)?;
        let column = |free: Free| {
            let size = hypothesis.step(free);
            let mut moved = hypothesis.clone();
            moved.set(free, hypothesis.get(free) + size);
            let size = moved.get(free) - hypothesis.get(free);
            let there = predicted(&moved)?;
            Some(there.iter().zip(&base).map(|(there, base)| (there - base) / size).collect())
        };
        // The encoder's zero moves every angle alike.
        let zero = || Some(vec![1.0; base.len()]);
        let columns =
            hypothesis.free().into_iter().map(|free| if free == Free::Zero { zero() } else { column(free) });
        let columns = columns.collect::<Option<_>>()?;
        Some(Self { base, columns })
    }
}

/// The equations of a run, its own zero eliminated.
fn gram(contest: &Contest, columns: &[Vec<f64>], distance: Vec<f64>) -> Gram {
    let own_zero = usize::from(contest.zero_nm > 0.0);
    let rows = distance.len();
    let mut x = DMatrix::zeros(rows, own_zero + columns.len() + 1);
    let of = |column: usize, row: usize| match column.checked_sub(own_zero) {
        None => 1.0,
        Some(index) => columns.get(index).unwrap_or(&distance).get(row).copied().unwrap_or(0.0),
    };
    for column in 0..x.ncols() {
        for row in 0..rows {
            let value = of(column, row) / contest.deviation;
            x[(row, column)] = if value.is_finite() { value } else { 0.0 };
        }
    }
    let ridges = vec![1.0 / (contest.zero_nm * contest.zero_nm); own_zero];
    Gram::without_nuisances(&x.tr_mul(&x), &ridges, rows as f64)
}

/// The squared distance that is left once numbers known with this covariance have taken up what they can.
fn left(gram: &Gram, covariance: &DMatrix<f64>) -> f64 {
    let columns: Vec<usize> = (0..covariance.nrows()).collect();
    let Some(known) = invert(covariance.clone()) else { return 0.0 };
    let (a, b) = gram.part(&columns);
    let Some(inverse) = invert(a + known) else { return 0.0 };
    (gram.square() - b.dot(&(inverse * &b))).max(0.0)
}

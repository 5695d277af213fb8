//! Fits a hypothesis through the model: Gauss-Newton with Levenberg's damping, nuisances eliminated piece by piece.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::DiagnosisError;
use crate::gram::{Gram, invert};
use crate::hypothesis::Hypothesis;
use crate::linear::{PieceEquations, Point, Setting, by_group, start_change};
use crate::piece::{Piece, Ready};
use crate::start::{best_start, better_start};
use crate::workers::map;
use nalgebra::DVector;

/// Steps at most.
const STEPS: usize = 12;
/// A gain below this part of a sample's noise for each sample is little, ...
const ENOUGH: f64 = 2e-5;
/// ... and so is one below this part of what is left beyond noise (where the model is wrong the valley's floor is rough),
/// or a promise below this part where the step that made it was refused.
const OF_THE_REST: f64 = 1e-3;
const OF_THE_REST_REFUSED: f64 = 1e-2;
/// Where so much is left beyond noise, in parts of it, other starts are tried before a fit ends.
const POOR: f64 = 0.2;
/// The damping after a refused step is at least this; less would change nothing.
const LEAST_DAMPING: f64 = 0.1;

/// A fitted hypothesis.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub point: Point,
    /// By group; the columns are what the hypothesis leaves free.
    pub groups: Vec<Gram>,
    /// Sum of squares over what was fitted.
    pub square: f64,
}

/// Fits on the pieces that `wanted` picks.
pub(crate) fn fit(
    setting: &Setting<'_>,
    begin: Point,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
    steps: usize,
) -> Result<Fitted, DiagnosisError> {
    let mut damping = 1e-4;
    let (mut at, mut here) = evaluate(setting, begin, wanted)?;
    let mut settled = false;
    for _ in 0..steps.min(STEPS) {
        let total = sum(&here.groups);
        let count = total.count.max(1.0);
        let rest = (here.square - count).max(0.0);
        let Some((beta, predicted)) = step(&total, &here.point.hypothesis, damping) else { break };
        let trial = moved(setting, &here.point, &at, &beta, wanted)?;
        let (next, there) = evaluate(setting, trial, wanted)?;
        let accepted = there.square < here.square;
        let (gain, part) = if accepted {
            (here.square - there.square, OF_THE_REST)
        } else {
            (predicted, OF_THE_REST_REFUSED)
        };
        if accepted {
            (at, here) = (next, there);
            settled = false;
            damping = (damping * 0.1).max(1e-7);
        }
        let little = gain < (ENOUGH * count).max(part * rest);
        if (little && (settled || rest < POOR * count)) || damping > 1e3 {
            break;
        }
        if settled {
            damping = (damping * 30.0).max(LEAST_DAMPING);
        } else if little || !accepted {
            // What a linear step promises is no better than the starts that it is taken from.
            let before = here.square;
            let point = with_best_starts(setting, &here.point, wanted)?;
            (at, here) = evaluate(setting, point, wanted)?;
            settled = true;
            if little && before - here.square < part * rest {
                break;
            }
        }
    }
    Ok(here)
}

fn evaluate(
    setting: &Setting<'_>,
    point: Point,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<(Vec<Option<PieceEquations>>, Fitted), DiagnosisError> {
    let columns = setting.own_columns(&point.hypothesis)?;
    let equations = setting.equations(&point, &columns, wanted)?;
    let groups = by_group(setting.campaign, &equations, columns.len());
    let square = groups.iter().map(Gram::square).sum();
    Ok((equations, Fitted { point, groups, square }))
}

pub(crate) fn sum(groups: &[Gram]) -> Gram {
    let width = groups.first().map_or(0, |group| group.matrix.nrows().saturating_sub(1));
    let mut total = Gram::zero(width);
    groups.iter().for_each(|group| total.add(group));
    total
}

/// The damped step and the gain that it promises. Numbers that rest on a bound and would leave it stay.
fn step(total: &Gram, hypothesis: &Hypothesis, damping: f64) -> Option<(DVector<f64>, f64)> {
    let free = hypothesis.free();
    let mut columns: Vec<usize> = (0..free.len()).collect();
    for _ in 0..=free.len() {
        let (mut a, b) = total.part(&columns);
        let plain = a.clone();
        for i in 0..a.nrows() {
            a[(i, i)] *= 1.0 + damping;
        }
        let beta = invert(a)? * &b;
        let stuck = columns.iter().zip(beta.iter()).position(|(column, change)| {
            free.get(*column).is_some_and(|number| {
                let mut there = hypothesis.clone();
                there.set(*number, hypothesis.get(*number) + change);
                hypothesis.on_bound(*number) && there.get(*number) == hypothesis.get(*number)
            })
        });
        if let Some(stuck) = stuck {
            columns.remove(stuck);
            continue;
        }
        let predicted = 2.0 * beta.dot(&b) - beta.dot(&(plain * &beta));
        let mut full = DVector::zeros(free.len());
        for (column, change) in columns.iter().zip(beta.iter()) {
            full[*column] = *change;
        }
        return Some((full, predicted.max(0.0)));
    }
    None
}

/// The point that a step leads to; a piece whose start does better as it was keeps it.
fn moved(
    setting: &Setting<'_>,
    point: &Point,
    equations: &[Option<PieceEquations>],
    beta: &DVector<f64>,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<Point, DiagnosisError> {
    let mut hypothesis = point.hypothesis.clone();
    for (free, change) in point.hypothesis.free().into_iter().zip(beta.iter()) {
        hypothesis.set(free, point.hypothesis.get(free) + change);
    }
    let zero_rad = hypothesis.zero_rad.unwrap_or(0.0);
    let starts = each_start(setting, point, &hypothesis, wanted, |index, piece, ready, start| {
        let own = equations.get(index).and_then(Option::as_ref);
        let bound = piece.start_bound(ready);
        let shifted = (start + own.map_or(0.0, |own| start_change(own, beta))).clamp(-bound, bound);
        better_start(setting, piece, ready, (shifted, start), zero_rad)
    })?;
    Ok(Point { starts, hypothesis })
}

/// The same hypothesis, each piece begun as it comes closest to what was measured.
pub(crate) fn with_best_starts(
    setting: &Setting<'_>,
    point: &Point,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<Point, DiagnosisError> {
    let hypothesis = point.hypothesis.clone();
    let zero_rad = hypothesis.zero_rad.unwrap_or(0.0);
    let starts = each_start(setting, point, &hypothesis, wanted, |_, piece, ready, start| {
        best_start(setting, piece, ready, (piece.first_start(ready), start), zero_rad)
    })?;
    Ok(Point { starts, hypothesis })
}

/// New starts for the pieces wanted.
fn each_start(
    setting: &Setting<'_>,
    point: &Point,
    hypothesis: &Hypothesis,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
    new: impl Fn(usize, &Piece, &Ready, f64) -> f64 + Sync,
) -> Result<Vec<f64>, DiagnosisError> {
    let ready = setting.ready(hypothesis)?;
    let pieces = &setting.campaign.pieces;
    Ok(map(setting.workers, pieces.len(), |index| {
        let start = point.starts.get(index).copied().unwrap_or(0.0);
        let piece = pieces.get(index).filter(|piece| wanted(piece));
        piece.map_or(start, |piece| new(index, piece, &ready, start))
    }))
}

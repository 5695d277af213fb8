//! Ripples over the angle with a phase of their own in each run: found in a residual, and fitted run by run.
//!
//! If runs have no common zero of the angle, or a gear or a spring lies between, no function of the angle holds for two runs.
//! The ripples of one run then say nothing about another's. Left in the residual, they hide every smaller cause.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::fit::equations::Setting;
use crate::log::loose_ripple::LooseRipple;
use crate::log::piece::Piece;
use crate::show::orders::{Ripple, ripples_by_run, turns_enough};
use crate::show::residual::PieceResidual;
use nalgebra::{DMatrix, DVector};

/// A ripple counts if its amplitude exceeds this many standard errors.
const CLEAR: f64 = 4.0;
/// Ripples with less than this share of the residual's sum of squares are left in it.
const LEAST_SHARE: f64 = 0.05;
/// Columns that are fitted beside a run's ripples, for errors of its friction: a constant and the direction. Speed and
/// acceleration are not among them: where a drive yields to a ripple they oscillate with it, and would absorb a part of it.
const BESIDE: usize = 2;
/// Keeps the equations solvable if columns are collinear: in a run in one direction, constant and direction are the same.
const RIDGE: f64 = 1e-9;

/// Loose ripples, and their sum at each sample of each piece.
pub(crate) struct Loose {
    pub ripples: Vec<LooseRipple>,
    pub by_piece: Vec<Vec<f64>>,
}

/// The loose ripples of a torque log's residual; `None` where there are none, or they are small.
pub(crate) fn loose(setting: &Setting<'_>, left: &[PieceResidual]) -> Option<Loose> {
    if !setting.campaign.kind.residual_is_torque() {
        return None;
    }
    let clear = |of: &Ripple| !of.in_phase && of.amplitude > CLEAR * of.std_error;
    let found: Vec<Ripple> = ripples_by_run(setting, left).into_iter().filter(clear).collect();
    if found.is_empty() {
        return None;
    }
    let orders: Vec<usize> = found.iter().map(|of| of.order).collect();
    let pieces = &setting.campaign.pieces;
    let mut by_piece: Vec<Vec<f64>> = pieces.iter().map(|piece| vec![0.0; piece.len()]).collect();
    for run in 0..setting.campaign.runs.len() {
        let own: Vec<usize> =
            (0..pieces.len()).filter(|at| pieces.get(*at).is_some_and(|of| of.run == run)).collect();
        if turns_enough(setting, run) {
            of_run(setting, left, &own, &orders, &mut by_piece);
        }
    }
    let weighted = |values: &[f64], piece: &Piece| -> f64 {
        values.iter().zip(&piece.weights).map(|(value, weight)| (value * weight).powi(2)).sum()
    };
    let taken: f64 = pieces.iter().zip(&by_piece).map(|(piece, own)| weighted(own, piece)).sum();
    let all: f64 = pieces.iter().zip(left).map(|(piece, left)| weighted(&left.residual, piece)).sum();
    let told = |of: Ripple| LooseRipple { order: of.order, amplitude: of.amplitude, std_error: of.std_error };
    (taken > LEAST_SHARE * all).then(|| Loose { ripples: found.into_iter().map(told).collect(), by_piece })
}

/// Fits the orders to a run's residual, and writes the sum of the waves into its pieces.
fn of_run(
    setting: &Setting<'_>,
    left: &[PieceResidual],
    own: &[usize],
    orders: &[usize],
    by_piece: &mut [Vec<f64>],
) {
    let width = BESIDE + 2 * orders.len();
    let mut matrix = DMatrix::zeros(width, width);
    let mut right = DVector::zeros(width);
    let samples = |at: &usize| Some((setting.campaign.pieces.get(*at)?, left.get(*at)?));
    for (piece, left) in own.iter().filter_map(samples) {
        for (index, (residual, weight)) in left.residual.iter().zip(&piece.weights).enumerate() {
            if *weight > 0.0 && residual.is_finite() {
                let row = row(piece, index, orders);
                let square = weight * weight;
                matrix.ger(square, &row, &row, 1.0);
                right.axpy(square * residual, &row, 1.0);
            }
        }
    }
    let scale = DVector::from_fn(width, |at, _| 1.0 / matrix[(at, at)].max(f64::MIN_POSITIVE).sqrt());
    let scaled = DMatrix::from_fn(width, width, |i, j| {
        scale[i] * matrix[(i, j)] * scale[j] + if i == j { RIDGE } else { 0.0 }
    });
    let Some(found) = scaled.cholesky().map(|factor| factor.solve(&right.component_mul(&scale))) else {
        return;
    };
    let found = found.component_mul(&scale);
    for at in own {
        let (Some(piece), Some(values)) = (setting.campaign.pieces.get(*at), by_piece.get_mut(*at)) else {
            continue;
        };
        for (index, value) in values.iter_mut().enumerate() {
            let row = row(piece, index, orders);
            *value = (BESIDE..width).map(|column| row[column] * found[column]).sum();
        }
    }
}

/// A sample's regressors: constant, direction, and cosine and sine of each order.
fn row(piece: &Piece, index: usize, orders: &[usize]) -> DVector<f64> {
    let (angle_rad, speed, _) = piece.kinematics(index);
    let direction = if speed == 0.0 { 0.0 } else { speed.signum() };
    let waves = orders.iter().flat_map(|order| {
        let (sin, cos) = (*order as f64 * angle_rad).sin_cos();
        [cos, sin]
    });
    DVector::from_iterator(BESIDE + 2 * orders.len(), [1.0, direction].into_iter().chain(waves))
}

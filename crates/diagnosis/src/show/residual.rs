//! The residual of every piece at one hypothesis, and its RMS over the pieces wanted.

use crate::DiagnosisError;
use crate::fit::equations::{Nuisances, Point, Setting};
use crate::fit::gauss_newton::{fit, with_best_starts};
use crate::log::cut::Place;
use crate::log::piece::Piece;
use crate::workers::map;
use std::collections::BTreeSet;

/// A piece's residual with the nuisances subtracted, and the prediction that they were added to.
pub(crate) struct PieceResidual {
    pub predicted: Vec<f64>,
    pub residual: Vec<f64>,
}

/// The point with the initial states fitted to the pieces wanted; the hypothesis stays as it is.
pub(crate) fn settled(
    setting: &Setting<'_>,
    point: &Point,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<Point, DiagnosisError> {
    let mut frozen = point.clone();
    frozen.hypothesis.members.iter_mut().for_each(|member| member.free.clear());
    frozen.hypothesis.corrections.iter_mut().for_each(|of| of.free = false);
    let zero = frozen.hypothesis.zero_rad.take();
    let steps = setting.campaign.kind.settling_steps;
    let mut shifted = fit(setting, with_zero(frozen, zero), wanted, steps)?.point;
    shifted.starts = with_best_starts(setting, &shifted, wanted)?.starts;
    shifted.hypothesis = point.hypothesis.clone();
    Ok(shifted)
}

/// The zero of the angle stays free: it is no cause.
fn with_zero(mut point: Point, zero: Option<f64>) -> Point {
    point.hypothesis.zero_rad = zero;
    point
}

/// Whether lost steps count in the residual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Jumps {
    Seen,
    TakenOut,
}

/// The residual of every piece, with lost steps taken out.
pub(crate) fn left(setting: &Setting<'_>, point: &Point) -> Result<Vec<PieceResidual>, DiagnosisError> {
    left_with(setting, point, Jumps::TakenOut)
}

/// The residual of every piece.
pub(crate) fn left_with(
    setting: &Setting<'_>,
    point: &Point,
    jumps: Jumps,
) -> Result<Vec<PieceResidual>, DiagnosisError> {
    let ready = setting.ready(&point.hypothesis)?;
    let zero = point.hypothesis.zero_rad.unwrap_or(0.0);
    let job = |index: usize| {
        let Some(piece) = setting.campaign.pieces.get(index) else {
            return PieceResidual { predicted: Vec::new(), residual: Vec::new() };
        };
        let mut predicted = piece.predict(&ready, point.start(index));
        let mut residual: Vec<f64> =
            piece.measured.iter().zip(&predicted).map(|(measured, model)| measured - model - zero).collect();
        if jumps == Jumps::Seen {
            for (from, jump) in &piece.jumps {
                residual.iter_mut().skip(*from).for_each(|value| *value += jump);
                predicted.iter_mut().skip(*from).for_each(|value| *value -= jump);
            }
        }
        let shift = own_zero(setting, piece, &residual);
        residual.iter_mut().for_each(|value| *value -= shift);
        predicted.iter_mut().for_each(|value| *value += zero + shift);
        PieceResidual { predicted, residual }
    };
    Ok(map(setting.workers, setting.campaign.pieces.len(), job))
}

/// A run's own zero as the fit estimates it: the residual's weighted mean, with the prior variance of zeros. The least certain
/// samples would dominate a plain mean.
fn own_zero(setting: &Setting<'_>, piece: &Piece, residual: &[f64]) -> f64 {
    let Nuisances { zero_nm, angle_zero } = setting.nuisances;
    if !angle_zero && zero_nm == 0.0 {
        return 0.0;
    }
    let ridge = setting.nuisances.zero_ridge();
    let counted =
        residual.iter().zip(&piece.weights).filter(|(value, weight)| **weight > 0.0 && value.is_finite());
    let (sum, weights) = counted.fold((0.0, 0.0), |(sum, weights), (value, weight)| {
        (sum + weight * weight * value, weights + weight * weight)
    });
    if weights > 0.0 { sum / (weights + ridge) } else { 0.0 }
}

/// Sum of squares and number of samples by group, over the pieces wanted. Loose ripples are included, because no model explains them.
pub(crate) fn squares(
    setting: &Setting<'_>,
    left: &[PieceResidual],
    wanted: &impl Fn(&Piece) -> bool,
) -> Vec<(f64, f64)> {
    let mut groups = vec![(0.0, 0.0); setting.campaign.groups.len()];
    for (piece, left) in setting.campaign.pieces.iter().zip(left).filter(|(piece, _)| wanted(piece)) {
        if let Some((square, count)) = groups.get_mut(piece.group) {
            let ripple = piece.ripple.iter().copied().chain(std::iter::repeat(0.0));
            let samples = left.residual.iter().zip(&piece.weights).zip(ripple);
            for ((value, _), ripple) in samples.filter(|((_, weight), _)| **weight > 0.0) {
                let value = value + ripple;
                *square += value * value;
                *count += 1.0;
            }
        }
    }
    groups.into_iter().filter(|(_, count)| *count > 0.0).collect()
}

pub(crate) fn rms_of(groups: &[(f64, f64)]) -> f64 {
    let (square, count) = groups.iter().fold((0.0, 0.0), |(s, c), group| (s + group.0, c + group.1));
    (square / f64::max(count, 1.0)).sqrt()
}

/// RMS over the pieces wanted.
pub(crate) fn rms_left(
    setting: &Setting<'_>,
    left: &[PieceResidual],
    wanted: &impl Fn(&Piece) -> bool,
) -> f64 {
    rms_of(&squares(setting, left, wanted))
}

/// RMS of the normalised residual over the pieces wanted, by the loss of the fit.
pub(crate) fn rms_as_fitted(
    setting: &Setting<'_>,
    left: &[PieceResidual],
    wanted: &impl Fn(&Piece) -> bool,
) -> f64 {
    setting.loss().rms(squares_as_fitted(setting, left, wanted).into_iter())
}

/// Sum of squares of the normalised residual and number of samples by group, over the pieces wanted.
pub(crate) fn squares_as_fitted(
    setting: &Setting<'_>,
    left: &[PieceResidual],
    wanted: &impl Fn(&Piece) -> bool,
) -> Vec<(f64, f64)> {
    let mut groups = vec![(0.0, 0.0); setting.campaign.groups.len()];
    for (piece, left) in setting.campaign.pieces.iter().zip(left).filter(|(piece, _)| wanted(piece)) {
        let Some((square, count)) = groups.get_mut(piece.group) else { continue };
        let samples = left.residual.iter().zip(&piece.weights).filter(|(_, weight)| **weight > 0.0);
        *square += samples.map(|(value, weight)| (value * weight).powi(2)).sum::<f64>();
        *count += piece.count();
    }
    groups.into_iter().filter(|(_, count)| *count > 0.0).collect()
}

/// A change of the prediction is judged where it changes a sample by at least this part, in mean square, of what it changes one in all pieces.
const SHOWS: f64 = 0.1;

/// Whether a piece judges the change from one residual to another: those held out that show it; where none of them does, all that are held out.
pub(crate) fn judges_of(
    setting: &Setting<'_>,
    one: &[PieceResidual],
    other: &[PieceResidual],
) -> impl Fn(&Piece) -> bool + use<> {
    let changed = changes(setting, one, other);
    let (square, count) = changed.iter().fold((0.0, 0.0), |sums, of| (sums.0 + of.0, sums.1 + of.1));
    let least = SHOWS * square / f64::max(count, 1.0);
    let judges = setting.campaign.judges();
    let place = |piece: &Piece| (piece.run, piece.rows.start);
    let pieces = setting.campaign.pieces.iter().zip(&changed);
    let showing = pieces.filter(|(piece, (square, count))| judges(piece) && *square >= least * count);
    let showing: BTreeSet<Place> = showing.map(|(piece, _)| place(piece)).collect();
    move |piece| judges(piece) && (showing.is_empty() || showing.contains(&place(piece)))
}

/// Each piece's sum of squared changes from one residual to another, in standard deviations, and its number of independent samples.
fn changes(setting: &Setting<'_>, one: &[PieceResidual], other: &[PieceResidual]) -> Vec<(f64, f64)> {
    let of = |(piece, (one, other)): (&Piece, (&PieceResidual, &PieceResidual))| {
        let both = one.residual.iter().zip(&other.residual).zip(&piece.weights);
        let square = |((one, other), weight): ((&f64, &f64), &f64)| (weight * (one - other)).powi(2);
        (both.map(square).filter(|square| square.is_finite()).sum(), piece.count())
    };
    setting.campaign.pieces.iter().zip(one.iter().zip(other)).map(of).collect()
}

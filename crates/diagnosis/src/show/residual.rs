//! The residual of every piece at one hypothesis, and its RMS over the pieces wanted.

use crate::DiagnosisError;
use crate::fit::equations::{Additive, Column, Nuisances, PieceEquations, Point, Setting};
use crate::fit::gauss_newton::{fit, with_best_starts};
use crate::log::cut::Place;
use crate::log::piece::Piece;
use crate::workers::map;
use std::collections::{BTreeMap, BTreeSet};

/// Offsets of each run beyond so many standard deviations of the model's own, as RMS, are no zeros: of two runs one in 10,000 has them by chance.
const PLAUSIBLE: f64 = 3.0;

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

/// A run's own zero, N·m or rad, and what the run tells of it beside its initial state, 0 to 1: a spool that rests keeps the torque that it
/// began with, and that is no zero.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OwnZero {
    pub zero: f64,
    pub told: f64,
}

/// The own zeros of all runs: pieces of one run have one zero, and are no further witnesses of what zeros scatter about.
pub(crate) fn own_zeros(setting: &Setting<'_>, point: &Point) -> Result<Vec<OwnZero>, DiagnosisError> {
    Ok(zeros_of_runs(setting, point)?.into_iter().map(|(_, zero)| zero).collect())
}

/// The own zeros, each with its run.
pub(crate) fn zeros_of_runs(
    setting: &Setting<'_>,
    point: &Point,
) -> Result<Vec<(usize, OwnZero)>, DiagnosisError> {
    let plain = Setting { nuisances: Nuisances { zero_nm: 0.0, angle_zero: false }, ..*setting };
    let equations = plain.equations(point, &[Column::Direct(Additive::Constant)], |_| true)?;
    let ridge = setting.nuisances.zero_ridge();
    let zero = |piece: PieceEquations| {
        let at = |column: usize| piece.gram.matrix.get((0, column)).copied().unwrap_or(0.0);
        let (data, cross) = (at(0), at(1));
        let all = (data + ridge).max(f64::MIN_POSITIVE);
        OwnZero { zero: cross / all, told: data / all }
    };
    let mut runs: BTreeMap<usize, Vec<OwnZero>> = BTreeMap::new();
    for (piece, equations) in setting.campaign.pieces.iter().zip(equations) {
        runs.entry(piece.run).or_default().extend(equations.map(zero));
    }
    Ok(runs.into_iter().filter_map(|(run, pieces)| Some((run, zero_of_run(&pieces)?))).collect())
}

/// A run's zero: the mean of its pieces', each by what it tells. The run tells what the best of them does.
fn zero_of_run(pieces: &[OwnZero]) -> Option<OwnZero> {
    let told: f64 = pieces.iter().map(|of| of.told).sum();
    let sum: f64 = pieces.iter().map(|of| of.told * of.zero).sum();
    let best = pieces.iter().map(|of| of.told).reduce(f64::max)?;
    Some(OwnZero { zero: sum / told.max(f64::MIN_POSITIVE), told: best })
}

/// Whether offsets of each run are as small as zeros are.
pub(crate) fn zeros_are_plausible(setting: &Setting<'_>, point: &Point) -> Result<bool, DiagnosisError> {
    let zero_nm = setting.nuisances.zero_nm;
    Ok(zero_nm == 0.0 || rms_of_zeros(&own_zeros(setting, point)?) < PLAUSIBLE * zero_nm)
}

/// RMS of own zeros, each by what its run tells of it.
fn rms_of_zeros(zeros: &[OwnZero]) -> f64 {
    let (squares, told) = zeros
        .iter()
        .fold((0.0, 0.0), |(squares, told), of| (squares + of.told * of.zero.powi(2), told + of.told));
    (squares / f64::max(told, f64::MIN_POSITIVE)).sqrt()
}

/// Mean of own zeros, and their standard deviation about it, each by what its run tells of it.
pub(crate) fn mean_and_scatter(zeros: &[OwnZero]) -> (f64, f64) {
    let told = zeros.iter().map(|of| of.told).sum::<f64>().max(f64::MIN_POSITIVE);
    let mean = zeros.iter().map(|of| of.told * of.zero).sum::<f64>() / told;
    let square = zeros.iter().map(|of| of.told * (of.zero - mean).powi(2)).sum::<f64>() / told;
    (mean, square.sqrt())
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

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::extend::hypothesis::Hypothesis;
    use crate::fixtures;
    use crate::log::campaign::Campaign;
    use crate::workers::OneAfterTheOther;
    use log_data::{Log, Run};
    use prediction::{Past, predict};
    use valve_model::Model;

    const ZERO_NM: f64 = 0.02;

    /// A run of 2 s whose torque is the model's and `more_nm`.
    fn run(model: &Model, number: usize, angle: impl Fn(f64) -> f64, more_nm: f64) -> Run {
        let times: Vec<f64> = (0..1000).map(|k| 2e-3 * f64::from(k)).collect();
        let mut run = Run {
            name: format!("{number}"),
            angle_rad: times.iter().map(|at| angle(*at)).collect(),
            time_s: times.iter().map(|at| at + 10.0 * number as f64).collect(),
            torque_nm: Some(vec![0.0; times.len()]),
            ..Run::default()
        };
        predict(&mut run, model, &Past::default()).unwrap();
        run.torque_nm.iter_mut().flatten().for_each(|torque| *torque += more_nm);
        run
    }

    /// A torque from before the run is no zero of a spool that rests through it.
    #[test]
    fn what_a_resting_spool_keeps_is_no_zero_of_its_run() {
        let given = fixtures::model(Vec::new());
        let swing = |at: f64| 0.3 * (4.0 * at).sin();
        let zeros = [ZERO_NM, -ZERO_NM, ZERO_NM, -ZERO_NM];
        let mut runs: Vec<Run> =
            zeros.iter().enumerate().map(|(number, zero)| run(&given, number, swing, *zero)).collect();
        runs.extend((4..8).map(|number| run(&given, number, |_| 0.1, 0.7)));
        let mut campaign =
            Campaign::new(&Log { runs, ..Log::default() }, &given, 0, &OneAfterTheOther).unwrap();
        campaign.pieces.iter_mut().for_each(|piece| piece.weights.fill(1e3));
        let nuisances = Nuisances { zero_nm: ZERO_NM, angle_zero: false };
        let setting = Setting::new(&campaign, &given, nuisances, &OneAfterTheOther);
        let hypothesis = Hypothesis::default();
        let ready = setting.ready(&hypothesis).unwrap();
        // A search leaves starts where they were found under other levels.
        let start = |piece: &Piece| {
            let first = piece.first_start(&ready);
            if piece.run < zeros.len() { first } else { first.shifted(0.4) }
        };
        let starts = campaign.pieces.iter().map(start).collect();
        let found = rms_of_zeros(&own_zeros(&setting, &Point { hypothesis, starts }).unwrap());
        assert!((0.8 * ZERO_NM..1.2 * ZERO_NM).contains(&found), "{found} N·m");
    }
}

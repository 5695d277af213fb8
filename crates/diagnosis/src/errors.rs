//! How well the numbers of a fit are known: the jackknife over groups, so that what noise, runs and the model's misfit
//! have in common within a run counts once; and what the encoder and the smoothing make of them, which all runs have in
//! common.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::DiagnosisError;
use crate::fit::{Fitted, sum};
use crate::gram::{Gram, invert};
use crate::linear::{Setting, by_group};
use crate::loss::Loss;
use crate::piece::Piece;
use crate::rivals::fitted_pieces;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Covariance of the free numbers, and the factor from standard error to the 95 % half width.
pub(crate) struct Spread {
    pub covariance: DMatrix<f64>,
    pub half_width: f64,
}

/// How often the motion is measured once more.
const AGAIN: u64 = 2;

impl Spread {
    /// With what the motion's own errors make of the numbers. Measured and smoothed once more, a motion is about as far from the
    /// measured one as that is from the true one (simulation-extrapolation: Cook and Stefanski, J. Am. Stat. Assoc. 89, 1994),
    /// and the numbers follow. Angle logs predict from the command, which has no such errors.
    pub fn with_motion(
        mut self,
        setting: &Setting<'_>,
        fitted: &Fitted,
        seed: u64,
    ) -> Result<Self, DiagnosisError> {
        if !setting.campaign.facts.is_torque() {
            return Ok(self);
        }
        // Not the draw that the weights were made from.
        for turn in 1..=AGAIN {
            let Some(change) = change_with_motion(setting, fitted, seed.wrapping_add(turn))? else {
                continue;
            };
            for (place, change) in change.iter().enumerate() {
                self.covariance[(place, place)] += change * change / AGAIN as f64;
            }
        }
        Ok(self)
    }
}

/// How far the numbers go where the motion is measured once more, in one step of the fit.
fn change_with_motion(
    setting: &Setting<'_>,
    fitted: &Fitted,
    seed: u64,
) -> Result<Option<DVector<f64>>, DiagnosisError> {
    let columns = setting.own_columns(&fitted.point.hypothesis)?;
    let again = |piece: &Piece| Some(piece.again(seed));
    let equations = setting.equations_as_seen(&fitted.point, &columns, fitted_pieces, again)?;
    let there = sum(&by_group(setting.campaign, &equations, columns.len()));
    let all: Vec<usize> = (0..columns.len()).collect();
    let (_, left_here) = sum(&fitted.groups).part(&all);
    let (a, left_there) = there.part(&all);
    Ok(invert(a).map(|inverse| inverse * (left_there - left_here)))
}

/// The spread of a fit's free numbers.
pub(crate) fn spread(fitted: &Fitted, loss: Loss) -> Option<Spread> {
    let groups = loss.weighted(&fitted.groups);
    let total = sum(&groups);
    let columns: Vec<usize> = (0..total.matrix.nrows() - 1).collect();
    let (a, b) = total.part(&columns);
    let white = invert(a.clone())?;
    let groups: Vec<&Gram> = groups.iter().filter(|group| group.count > 0.0).collect();
    let count = groups.len() as f64;
    let mut clustered = DMatrix::zeros(columns.len(), columns.len());
    for group in &groups {
        let (own_a, own_b) = group.part(&columns);
        let mut rest = &a - own_a;
        for i in 0..rest.nrows() {
            rest[(i, i)] += 1e-3 * a[(i, i)];
        }
        let change = invert(rest)? * (&b - own_b);
        clustered += &change * change.transpose();
    }
    clustered *= (count - 1.0) / count;
    // Never better than white noise allows.
    let mut covariance = clustered;
    for i in 0..covariance.nrows() {
        let least = white[(i, i)];
        if covariance[(i, i)] < least {
            covariance[(i, i)] = least;
        }
    }
    let freedom = (count - 1.0).max(1.0);
    let half_width = StudentsT::new(0.0, 1.0, freedom).map_or(1.96, |t| t.inverse_cdf(0.975));
    Some(Spread { covariance, half_width })
}

//! Where a curve over a covariate bends: at even parts of what the data have of it.

use crate::log::campaign::Campaign;
use crate::log::moments::{RESTS, covariates};
use crate::log::piece::Piece;
use valve_model::Covariate;

/// The parts of the samples below each knot.
const PARTS: [f64; 7] = [0.02, 0.15, 0.32, 0.5, 0.68, 0.85, 0.98];
/// Every so many samples are looked at.
const EVERY: usize = 20;

/// The knots, rising; `None` if the data hold fewer than three values of it that differ.
pub(crate) fn knots(campaign: &Campaign, of: Covariate) -> Option<Vec<f64>> {
    let fitted = campaign.pieces.iter().filter(|piece| piece.is_fitted());
    let values = fitted.flat_map(|piece| values(piece, of)).filter(|value| value.is_finite());
    // What moves both ways bends at the same speeds in both, and where it turns back.
    let both_ways = of == Covariate::Speed && campaign.facts.excitation.both_ways;
    let mut values: Vec<f64> = if both_ways {
        values.filter(|speed| speed.abs() > RESTS).flat_map(|speed| [speed, -speed]).chain([0.0]).collect()
    } else {
        values.collect()
    };
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let at = |part: &f64| values.get((part * last as f64).round() as usize).copied();
    let (low, high) = (at(&0.0)?, at(&1.0)?);
    let mut knots: Vec<f64> = PARTS.iter().filter_map(at).map(|knot| rounded(knot, high - low)).collect();
    let apart = 0.01 * (high - low);
    knots.dedup_by(|next, knot| *next - *knot <= apart);
    (knots.len() >= 3 && high > low).then_some(knots)
}

/// To a thousandth of the range.
fn rounded(value: f64, range: f64) -> f64 {
    let digit = 10f64.powf((1e-3 * range).log10().floor());
    let rounded = (value / digit).round() * digit;
    // Without the digits that binary numbers add.
    format!("{rounded:.12e}").parse().unwrap_or(rounded)
}

fn values(piece: &Piece, of: Covariate) -> impl Iterator<Item = f64> + '_ {
    covariates(piece).step_by(EVERY).map(move |at| at.get(of.place()).copied().unwrap_or(f64::NAN))
}

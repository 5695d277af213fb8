//! Waves in the residual over a quantity, at a frequency of their own: to a part of a period over the whole log.

use crate::extend::stroke::turns;
use crate::fit::equations::Setting;
use crate::log::moments::{Moment, moments};
use crate::numerics::statistics::{CHANCE, SHARE_LEFT};
use crate::show::orders::powers_at;
use crate::show::residual::PieceResidual;
use nalgebra::{Matrix3, Vector3};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use std::f64::consts::TAU;

/// Steps of the scan for a period over the log, and in all at most.
const STEPS_A_PERIOD: f64 = 6.0;
const MOST_STEPS: f64 = 20_000.0;
/// Orders of the angle that are looked through. One is the angle's own where it is closer to a whole number than `BESIDE`.
const ORDERS: (f64, f64) = (0.3, 16.0);
const BESIDE: f64 = 0.1;
/// Periods that the angle goes through at least: of fewer, slow noise looks like a wave.
const PERIODS: f64 = 3.0;
/// Periods of an order of its own at least: part of one is a slope or a curvature, which any law has.
const A_WAVE: f64 = 1.0;
/// What a constant, a cosine and a sine take of the degrees of freedom.
const OF_WAVE: f64 = 3.0;

/// A wave over a quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wave {
    /// Radians for a unit of the quantity.
    pub frequency: f64,
    /// What the data span of it.
    pub span: f64,
}

impl Wave {
    /// So many periods lie within the span.
    fn periods(&self) -> f64 {
        self.frequency * self.span / TAU
    }
}

/// The strongest order of the angle in a residual, if it is no whole number: what turns with another shaft. On a short stroke a whole one may look
/// like it; which of the two it is shows in what either leaves.
pub(crate) fn order_of_its_own(setting: &Setting<'_>, left: &[PieceResidual]) -> Option<Wave> {
    let wave = strongest_order(setting, left)?;
    let is_own = (wave.frequency - wave.frequency.round()).abs() > BESIDE;
    (is_own && wave.periods() >= A_WAVE).then_some(wave)
}

/// Whether a residual, of which so many samples count as one independent sample, holds a wave over the angle, of a whole order or not, that is
/// more than chance.
pub(crate) fn goes_with_the_angle(
    setting: &Setting<'_>,
    left: &[PieceResidual],
    per_independent: f64,
) -> bool {
    let wave = strongest_order(setting, left).filter(|wave| wave.periods() >= PERIODS);
    let Some(wave) = wave else { return false };
    let Some(Share { share, count }) = of_wave(setting, left, wave.frequency) else { return false };
    let freedom = (count / per_independent - OF_WAVE).max(1.0);
    let statistic = (share / 2.0) / ((1.0 - share).max(f64::MIN_POSITIVE) / freedom);
    // As many independent orders were looked through as periods of the highest fit in.
    let tests = ((ORDERS.1 - ORDERS.0) * wave.span / TAU).max(1.0);
    let by_chance = FisherSnedecor::new(2.0, freedom).map_or(1.0, |fisher| tests * fisher.sf(statistic));
    share > SHARE_LEFT && by_chance < CHANCE
}

fn strongest_order(setting: &Setting<'_>, left: &[PieceResidual]) -> Option<Wave> {
    let span = TAU * turns(&setting.campaign.facts);
    let order = strongest(setting, left, (ORDERS.0, ORDERS.1, span), |at| at.angle_rad)?;
    Some(Wave { frequency: order, span })
}

/// The strongest of the angular frequencies from and to, over a quantity that spans so much.
pub(crate) fn strongest(
    setting: &Setting<'_>,
    left: &[PieceResidual],
    (from, to, span): (f64, f64, f64),
    over: impl Fn(&Moment) -> f64,
) -> Option<f64> {
    let steps = ((to - from) / TAU * STEPS_A_PERIOD * span).clamp(2.0, MOST_STEPS);
    let step = (to - from) / steps;
    let fitted = setting.campaign.pieces.iter().zip(left).filter(|(piece, _)| piece.is_fitted());
    let values = fitted.flat_map(|(piece, left)| {
        let weighted =
            left.residual.iter().zip(&piece.weights).map(|(residual, weight)| residual * weight * weight);
        moments(piece).map(|at| over(&at)).zip(weighted)
    });
    let powers = powers_at(values, (from, step, steps as usize));
    let best = powers.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?.0;
    Some(from + step * best as f64)
}

/// What a wave accounts for.
struct Share {
    /// Of the sum of squares about the mean.
    share: f64,
    /// The sum of the samples' information.
    count: f64,
}

/// The wave of this order of the angle, fitted to the residual beside a constant.
fn of_wave(setting: &Setting<'_>, left: &[PieceResidual], order: f64) -> Option<Share> {
    let (mut matrix, mut right, mut square, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0.0, 0.0);
    for (piece, left) in setting.campaign.pieces.iter().zip(left) {
        let weights = piece.weights.iter().zip(&piece.information);
        for ((at, residual), (weight, information)) in moments(piece).zip(&left.residual).zip(weights) {
            if *weight > 0.0 && at.angle_rad.is_finite() && residual.is_finite() {
                let (sin, cos) = (order * at.angle_rad).sin_cos();
                let row = Vector3::new(1.0, cos, sin) * information.sqrt();
                let value = residual * weight;
                matrix += row * row.transpose();
                right += row * value;
                square += value * value;
                count += information;
            }
        }
    }
    let explained = right.dot(&matrix.cholesky()?.solve(&right));
    let of_mean = right.x * right.x / matrix.m11;
    let about_mean = square - of_mean;
    (about_mean > 0.0).then(|| Share { share: (explained - of_mean) / about_mean, count })
}

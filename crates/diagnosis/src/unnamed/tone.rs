//! Waves in the residual over the clock or the angle, at a frequency of their own: to a part of a period over the whole log.

use crate::extend::stroke::turns;
use crate::fit::equations::Setting;
use crate::log::moments::{Moment, moments};
use crate::show::orders::powers_at;
use crate::show::residual::PieceResidual;
use crate::show::tone::tone;
use std::f64::consts::TAU;

/// On either side of a spectrum's frequency, Hz.
const BESIDE_HZ: f64 = 1.5;
/// Steps of the scan for a period over the log, and in all at most.
const STEPS_A_PERIOD: f64 = 6.0;
const MOST_STEPS: f64 = 20_000.0;
/// Orders of the angle that are looked through. One is the angle's own where it is closer to a whole number than `BESIDE`, or than a
/// stroke tells apart.
const ORDERS: (f64, f64) = (0.3, 16.0);
const BESIDE: f64 = 0.1;

/// A wave over a quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wave {
    /// Radians for a unit of the quantity.
    pub frequency: f64,
    /// What the data span of it.
    pub span: f64,
}

/// The tone over the clock that a residual is mostly made of.
pub(crate) fn tone_over_the_clock(setting: &Setting<'_>, left: &[PieceResidual]) -> Option<Wave> {
    let around = TAU * tone(setting, left)?.hz;
    let time_s = |at: &Moment| at.time_s;
    let times = || setting.campaign.pieces.iter().flat_map(|piece| piece.driven.time_s()).copied();
    let span = times().max_by(f64::total_cmp)? - times().min_by(f64::total_cmp)?;
    let beside = TAU * BESIDE_HZ;
    let range = ((around - beside).max(0.0), around + beside, span);
    strongest(setting, left, range, time_s).map(|frequency| Wave { frequency, span })
}

/// The strongest order of the angle in a residual, if it is no whole number: what turns with another shaft.
pub(crate) fn order_of_its_own(setting: &Setting<'_>, left: &[PieceResidual]) -> Option<Wave> {
    let turns = turns(&setting.campaign.facts);
    let span = TAU * turns;
    let order = strongest(setting, left, (ORDERS.0, ORDERS.1, span), |at| at.angle_rad)?;
    let is_own = (order - order.round()).abs() > BESIDE.max(0.5 / turns);
    is_own.then_some(Wave { frequency: order, span })
}

/// The strongest of the angular frequencies from and to, over a quantity that spans so much.
fn strongest(
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

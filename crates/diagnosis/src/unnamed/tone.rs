//! The tone over the clock in a residual, at its own frequency.

use crate::fit::equations::Setting;
use crate::log::moments::Moment;
use crate::show::residual::PieceResidual;
use crate::show::tone::tone;
use crate::show::waves::{Wave, strongest};
use std::f64::consts::TAU;

/// On either side of a spectrum's frequency, Hz.
const BESIDE_HZ: f64 = 1.5;

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

//! The acceptance threshold: what a candidate must gain on held-out groups beside the causes accepted so far.
//!
//! The threshold is the largest of a fixed floor, a share of the residual beyond noise, and the misfit that the forms of the
//! accepted causes may leave: a candidate that gains less, and leaves more than noise, may only be fitting that misfit.

use crate::name::forms::{HYSTERESIS, MISFIT};
use crate::name::selection::Selection;
use crate::numerics::gram::HeldOut;
use crate::numerics::loss::Loss;
use valve_model::EffectId;

/// Least cut of the held-out RMS, relative to the noise.
pub(crate) const FLOOR: f64 = 0.01;
/// A cause that takes this part of what is left beyond noise does not fit a misfit: that has hardly ever exactly the form of one cause. Beside a
/// cause that explains hundreds of times the noise no other could be found, and least of all a transducer that is late by a little.
const NEARLY_ALL: f64 = 0.9;
/// What presliding-hysteresis may leave as its misfit, as a share of the sum of squares that it explains. It is more in an angle
/// log, where a small misfit makes the rotor slip at other moments.
const HYSTERESIS_MISFIT: f64 = 0.1;
const HYSTERESIS_MISFIT_IN_ANGLES: f64 = 0.3;
/// Causes that change the same presliding stiffness as the hysteresis, and the larger share of its explained squares
/// that they must exceed.
const SAME_STIFFNESS: [EffectId; 2] = [EffectId::BristleStiffness, EffectId::CouplingCompliance];
const MISFIT_OF_SAME_STIFFNESS: f64 = 0.3;
/// Beside presliding-hysteresis in an angle log, a further cause must explain this part of the residual beyond noise.
const LEAST_BESIDE_HYSTERESIS: f64 = 0.5;

/// True if presliding-hysteresis is accepted in an angle log: longer fits keep shrinking its residual, so a further candidate
/// may only be fitting that.
pub(crate) fn hysteresis_keeps_shrinking(state: &Selection, loss: Loss) -> bool {
    loss == Loss::OwnNoise && state.fitted.point.hypothesis.has(HYSTERESIS)
}

/// How much a candidate cuts the held-out mean square, relative to the noise variance.
pub(crate) fn cut_of_squares(state: &Selection, held_out: &HeldOut) -> f64 {
    (state.held_out.total() - held_out.total()) / state.samples()
}

/// True if a candidate with this held-out RMS and these squares reaches `part` of both thresholds: on the RMS as the loss counts
/// it, and on the plain sum of squares.
pub(crate) fn reaches_threshold(
    state: &Selection,
    (id, rms, held_out): (EffectId, f64, &HeldOut),
    part: f64,
    loss: Loss,
) -> bool {
    state.rms - rms >= part * rms_threshold(state, loss)
        && cut_of_squares(state, held_out) >= part * squares_threshold(state, id, loss)
}

/// Threshold on the cut of the held-out RMS, relative to the noise.
pub(crate) fn rms_threshold(state: &Selection, loss: Loss) -> f64 {
    let square = state.rms.powi(2);
    let causes = state.causes();
    let part = if hysteresis_keeps_shrinking(state, loss) {
        LEAST_BESIDE_HYSTERESIS
    } else {
        loss.least_part(causes)
    };
    let least = least_cut(square - 1.0, state.forms.inexact, part);
    FLOOR.max(state.rms - (square - least).max(0.0).sqrt())
}

/// The least cut of the held-out mean square, of the part `beyond` noise, beside causes of inexact forms that explain so much.
fn least_cut(beyond: f64, inexact: f64, part: f64) -> f64 {
    (MISFIT * inexact).min(NEARLY_ALL * beyond).max(part * beyond)
}

/// Threshold on the cut of the held-out mean square. It applies from the third cause on and beside presliding-hysteresis, where
/// the logarithmic loss of angle logs would hide how little a candidate cuts.
fn squares_threshold(state: &Selection, id: EffectId, loss: Loss) -> f64 {
    let many = state.causes() >= 2 && state.forms.inexact > 0.0;
    let of_many = if many { MISFIT * state.forms.inexact_of_squares } else { f64::NEG_INFINITY };
    let left = match loss {
        _ if SAME_STIFFNESS.contains(&id) => MISFIT_OF_SAME_STIFFNESS,
        Loss::Squares => HYSTERESIS_MISFIT,
        Loss::OwnNoise => HYSTERESIS_MISFIT_IN_ANGLES,
    };
    let loose = state.fitted.point.hypothesis.has(HYSTERESIS);
    let of_loose = if loose { left * state.forms.hysteresis } else { f64::NEG_INFINITY };
    of_many.max(of_loose)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_takes_nearly_all_that_is_left_is_no_misfit() {
        // Beyond noise, explained by inexact forms, the loss's own part; the least cut.
        for (beyond, inexact, part, expected) in [
            (10.0, 0.0, 0.25, 2.5),
            (10.0, 100.0, 0.25, 2.5),
            (10.0, 200.0, 0.25, 4.0),
            // A threshold beyond all that is left could be reached by nothing.
            (1.7, 122.0, 0.25, 1.53),
            (1.7, 1e6, 0.25, 1.53),
            (1.7, 1e6, 0.95, 1.615),
        ] {
            let cut = least_cut(beyond, inexact, part);
            assert!((cut - expected).abs() < 1e-9, "{beyond}, {inexact}, {part}: {cut}");
        }
    }
}

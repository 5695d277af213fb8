//! What a cause must be worth beside those that are in: more than their forms leave to pick from.

use crate::name::forms::LOOSE;
use crate::name::selection::Selection;
use crate::numerics::gram::HeldOut;
use crate::numerics::loss::Loss;
use valve_model::EffectId;

/// A cause must cut the held-out RMS by so much, in parts of the noise.
pub(crate) const FLOOR: f64 = 0.01;
/// ... and by so much of what all causes of an open form explain, as a mean square: below it lies the misfit of a form.
pub(crate) const SHARE: f64 = 0.02;
/// A cause whose form is one of many: no bank of elements is the other's. So much of what it explains of the plain squares may
/// be left to pick from; more in an angle log, whose rotor then slips at other moments.
const LEFT_BY_LOOSE: f64 = 0.1;
const LEFT_BY_LOOSE_IN_ANGLES: f64 = 0.3;
/// ... and to causes that bend what it bends itself, as the elements' own stiffness would.
const BENDS_AS_LOOSE: [EffectId; 2] = [EffectId::BristleStiffness, EffectId::CouplingCompliance];
const LEFT_TO_SUCH: f64 = 0.3;
/// In an angle log a further cause beside it must explain so much of what is left beyond noise.
const LEAST_BESIDE_LOOSE: f64 = 0.5;

/// Whether a loose form is in where the rotor answers what it leaves with slips at other moments: fits find less to be left
/// the longer they go on, and a further cause's is one of them.
pub(crate) fn leaves_much_to_pick(state: &Selection, loss: Loss) -> bool {
    loss == Loss::OwnNoise && state.fitted.point.hypothesis.has(LOOSE)
}

/// By how much a rival cuts the plain squares, as a mean in parts of the noise's.
pub(crate) fn cut_of_squares(state: &Selection, held_out: &HeldOut) -> f64 {
    (state.held_out.total() - held_out.total()) / state.samples()
}

/// Whether a rival with this name, RMS and these squares cuts at least a part of what it has to: more than the floor, and more
/// than the forms of those that are in leave.
pub(crate) fn cuts(
    state: &Selection,
    (id, rms, held_out): (EffectId, f64, &HeldOut),
    part: f64,
    loss: Loss,
) -> bool {
    state.rms - rms >= part * least_cut(state, loss)
        && cut_of_squares(state, held_out) >= part * least_cut_of_squares(state, id, loss)
}

/// By how much a cause must cut the held-out RMS, in parts of the noise.
pub(crate) fn least_cut(state: &Selection, loss: Loss) -> f64 {
    let square = state.rms.powi(2);
    let causes = state.fitted.point.hypothesis.members.len();
    let part = if leaves_much_to_pick(state, loss) { LEAST_BESIDE_LOOSE } else { loss.least_part(causes) };
    let least = (SHARE * state.forms.open).max(part * (square - 1.0));
    FLOOR.max(state.rms - (square - least).max(0.0).sqrt())
}

/// ... and the plain squares; logarithms hide how little a third cause or a further one, or one beside a loose form, cuts.
fn least_cut_of_squares(state: &Selection, id: EffectId, loss: Loss) -> f64 {
    let many = state.fitted.point.hypothesis.members.len() >= 2 && state.forms.open > 0.0;
    let of_many = if many { SHARE * state.explained() } else { f64::NEG_INFINITY };
    let left = match loss {
        _ if BENDS_AS_LOOSE.contains(&id) => LEFT_TO_SUCH,
        Loss::Squares => LEFT_BY_LOOSE,
        Loss::OwnNoise => LEFT_BY_LOOSE_IN_ANGLES,
    };
    let loose = state.fitted.point.hypothesis.has(LOOSE);
    let of_loose = if loose { left * state.forms.loose } else { f64::NEG_INFINITY };
    of_many.max(of_loose)
}

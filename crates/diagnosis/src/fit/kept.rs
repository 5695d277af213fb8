//! Sensitivities to the corrections of the model's numbers, computed once and kept through the fits of a search.
//!
//! Corrections stay within their tolerance, a few per cent, so the prediction is nearly linear in them. A fit that uses the
//! sensitivities of a nearby point converges to the same numbers, up to an error proportional to the residual and to the change
//! of the sensitivities. Each of its steps costs two simulations instead of one for each correction. Fits that conclusions are
//! drawn from use exact sensitivities.

use valve_model::EffectId;

/// The sensitivities of every fitted piece at one point.
pub(crate) struct Kept {
    /// The corrections.
    pub ids: Vec<EffectId>,
    /// By piece and correction; empty where a piece is not fitted.
    pub by_piece: Vec<Vec<Vec<f64>>>,
}

impl Kept {
    /// The index of a correction's sensitivities.
    pub fn place(&self, id: EffectId) -> Option<usize> {
        self.ids.iter().position(|known| *known == id)
    }

    /// A piece's sensitivities to the correction at this index.
    pub fn of(&self, piece: usize, place: usize) -> &[f64] {
        self.by_piece.get(piece).and_then(|columns| columns.get(place)).map_or(&[], Vec::as_slice)
    }
}

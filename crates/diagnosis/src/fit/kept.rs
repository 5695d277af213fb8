//! Sensitivities to the corrections of the model's numbers, computed once and kept through the fits of a search.
//!
//! These numbers move within their tolerance alone, a few per cent, and the prediction follows them nearly in a straight line. A fit
//! whose steps use the sensitivities of a nearby point comes to the same numbers up to what is left times their change, and each of its
//! steps costs two simulations instead of one for each correction. What is concluded from is fitted with exact ones.

use valve_model::EffectId;

/// The sensitivities of every fitted piece at one point.
pub(crate) struct Kept {
    /// The corrections.
    pub ids: Vec<EffectId>,
    /// By piece and correction; empty where a piece is not fitted.
    pub by_piece: Vec<Vec<Vec<f64>>>,
}

impl Kept {
    /// The place of a correction's sensitivities.
    pub fn place(&self, id: EffectId) -> Option<usize> {
        self.ids.iter().position(|known| *known == id)
    }

    /// A piece's sensitivities to the correction at this place.
    pub fn of(&self, piece: usize, place: usize) -> &[f64] {
        self.by_piece.get(piece).and_then(|columns| columns.get(place)).map_or(&[], Vec::as_slice)
    }
}

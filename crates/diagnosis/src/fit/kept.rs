//! Sensitivities to the corrections of the model's numbers, computed once and kept through the fits of a search.
//!
//! These numbers move within their tolerance alone, a few per cent, and the prediction follows them nearly in a straight line. A fit
//! whose steps use the sensitivities of a nearby point comes to the same numbers up to what is left times their change, and each of its
//! steps costs two simulations instead of one for each correction. What is concluded from is fitted with exact ones.

use crate::DiagnosisError;
use crate::extend::hypothesis::Free;
use crate::fit::equations::{Column, Point, Setting, sensitivity};
use crate::workers::map;
use valve_model::EffectId;

/// The sensitivities of every fitted piece at one point.
pub(crate) struct Kept {
    ids: Vec<EffectId>,
    /// By piece and correction; empty where a piece is not fitted.
    by_piece: Vec<Vec<Vec<f64>>>,
}

impl Kept {
    /// Of a torque log with bristles, whose simulation is what a search costs; `None` for others, where a torque is cheap, or an angle
    /// may slip elsewhere.
    pub fn at(setting: &Setting<'_>, point: &Point) -> Result<Option<Self>, DiagnosisError> {
        let campaign = setting.campaign;
        if !campaign.kind.motion_is_measured || campaign.facts.stiffness.is_none() {
            return Ok(None);
        }
        let setting = Setting { kept: None, ..*setting };
        let (mut ids, mut columns) = (Vec::new(), Vec::new());
        for (index, of) in point.hypothesis.corrections.iter().enumerate() {
            if let Column::Simulated(moved, size) =
                setting.own_column(&point.hypothesis, Free::Correction(index))?
            {
                ids.push(of.id);
                columns.push((moved, size));
            }
        }
        let ready = setting.ready(&point.hypothesis)?;
        let by_piece = map(setting.workers, campaign.pieces.len(), |index| {
            let Some(piece) = campaign.pieces.get(index).filter(|piece| piece.is_fitted()) else {
                return Vec::new();
            };
            let start = point.start(index);
            let base = piece.predict(&ready, start);
            let each = columns
                .iter()
                .map(|(moved, size)| sensitivity(piece, &base, (moved, *size), start).collect());
            each.collect()
        });
        Ok(Some(Self { ids, by_piece }))
    }

    /// The place of a correction's sensitivities.
    pub fn place(&self, id: EffectId) -> Option<usize> {
        self.ids.iter().position(|known| *known == id)
    }

    /// A piece's sensitivities to the correction at this place.
    pub fn of(&self, piece: usize, place: usize) -> &[f64] {
        self.by_piece.get(piece).and_then(|columns| columns.get(place)).map_or(&[], Vec::as_slice)
    }
}

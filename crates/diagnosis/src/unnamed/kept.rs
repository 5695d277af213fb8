//! Laws held against what is left without any, on the runs held out.

use crate::DiagnosisError;
use crate::fit::equations::Point;
use crate::measure::gain::{Part, part_left_as_fitted};
use crate::measure::judgement::Judgement;
use crate::show::residual::PieceResidual;
use crate::unnamed::search::Laws;

/// A law must leave at most this part of the error on runs held out: a change that is smaller is none that a user would notice. A
/// further one must leave at most this part of what those before it leave.
pub(crate) const MOST_LEFT: f64 = 0.9;
/// A fit with fewer causes or laws is taken if it leaves at most so many times as much on the runs held out.
pub(crate) const HARDLY_MORE: f64 = 1.05;

/// Laws with what they leave, and what that gains.
pub(crate) struct Kept {
    pub laws: Laws,
    pub point: Point,
    pub after: Vec<PieceResidual>,
    /// The part of the error on runs held out that is left, each sample counted by how well it is known, and its 95 % interval.
    pub part: f64,
    pub ci95: [f64; 2],
}

impl Kept {
    /// Laws, held against what is left without any.
    pub fn of(judged: &Judgement<'_>, bare: &[PieceResidual], laws: Laws) -> Result<Self, DiagnosisError> {
        let (point, after) = judged.everywhere(&laws.tried.fitted)?;
        let Part { ratio: part, ci95 } = part_left_as_fitted(&judged.setting, bare, &after, judged.seed);
        Ok(Self { laws, point, after, part, ci95 })
    }

    /// Another fit of the same laws in its place, if that leaves hardly more on the runs held out.
    pub fn or(self, other: Self) -> Self {
        if other.part <= HARDLY_MORE * self.part && other.ci95[1] < 1.0 { other } else { self }
    }
}

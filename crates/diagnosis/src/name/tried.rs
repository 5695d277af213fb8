//! A fitted hypothesis with its held-out error, by cross-validation over the folds.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::{Fitted, Progress, fit, fit_on};
use crate::fit::pattern::search;
use crate::log::piece::Piece;
use crate::numerics::gram::{Gram, HeldOut, leave_out};

/// Steps of a fit through the model.
pub(crate) const STEPS: usize = 8;
/// Held-out RMS within `EQUAL` (relative to the noise) counts as equal; within `NEARLY` where the groups disagree.
pub(crate) const EQUAL: f64 = 0.003;
pub(crate) const NEARLY: f64 = 0.01;

/// A fitted hypothesis and its error on the groups that each fold leaves out.
#[derive(Clone)]
pub(crate) struct Tried {
    pub fitted: Fitted,
    pub held_out: HeldOut,
    /// Held-out RMS relative to the noise.
    pub rms: f64,
}

impl Tried {
    /// Fits from `begin` on, in at most `steps` steps.
    pub fn from(setting: &Setting<'_>, begin: Point, steps: usize) -> Result<Self, DiagnosisError> {
        Ok(Self::judged(setting, fit(setting, begin, &Piece::is_fitted, steps)?))
    }

    /// Continues a fit from its point and damping.
    pub fn from_progress(
        setting: &Setting<'_>,
        begin: (Point, Progress),
        steps: usize,
    ) -> Result<Self, DiagnosisError> {
        Ok(Self::judged(setting, fit_on(setting, begin, &Piece::is_fitted, steps)?))
    }

    /// Continues the fit by `steps` at most, unless it has converged.
    pub fn further(self, setting: &Setting<'_>, steps: usize) -> Result<Self, DiagnosisError> {
        if self.fitted.ended {
            return Ok(self);
        }
        Self::from_progress(setting, (self.fitted.point, self.fitted.progress), steps)
    }

    pub fn judged(setting: &Setting<'_>, fitted: Fitted) -> Self {
        let held_out = judge(setting, &fitted);
        let rms = setting.loss().rms(held_out.each(&fitted.groups));
        Self { fitted, held_out, rms }
    }

    /// Refits from better numbers of one member if a pattern search finds some; it is tried where the residual is far above noise.
    pub fn searched(self, setting: &Setting<'_>, member: usize) -> Result<Self, DiagnosisError> {
        let Some(better) = search(setting, &self.fitted, member, &Piece::is_fitted)? else { return Ok(self) };
        let further = if_possible(Self::from(setting, better, STEPS))?;
        Ok(further.filter(|further| further.fitted.loss < self.fitted.loss).unwrap_or(self))
    }
}

/// Held-out squares of a fit: one Gauss-Newton step without each fold, evaluated on that fold. Numbers at their bounds stay there.
pub(crate) fn judge(setting: &Setting<'_>, fitted: &Fitted) -> HeldOut {
    let groups = &fitted.groups;
    let hypothesis = &fitted.point.hypothesis;
    let width = groups.first().map_or(0, |group| group.matrix.nrows().saturating_sub(1));
    let free = hypothesis.free().into_iter().take(width).enumerate();
    let columns: Vec<usize> =
        free.filter(|(_, free)| !hypothesis.is_at_bound(*free)).map(|(place, _)| place).collect();
    let weighted = setting.loss().weighted(groups);
    leave_out(&weighted, groups, &setting.campaign.fold_of, &columns)
        .unwrap_or_else(|| HeldOut { squares: groups.iter().map(Gram::square).collect() })
}

//! The state of the search for causes: what is accepted so far, and what each round decided.

use crate::fit::gauss_newton::Fitted;
use crate::name::forms::Forms;
use crate::name::tried::Tried;
use crate::numerics::gram::HeldOut;
use crate::numerics::loss::Loss;
use valve_model::EffectId;

/// What came out.
#[derive(Debug, Clone)]
pub(crate) struct Selection {
    pub fitted: Fitted,
    pub held_out: HeldOut,
    pub rms_first: f64,
    pub rms: f64,
    /// What was held out at first.
    pub held_out_first: HeldOut,
    pub forms: Forms,
    pub rounds: Vec<Round>,
    /// Groups of names of which one is needed; its representative is a member of the hypothesis.
    pub ambiguous: Vec<(EffectId, Vec<EffectId>)>,
    /// For each pair of names that can't be told apart, the angle between what they change, degrees.
    pub angles: Vec<(EffectId, EffectId, f64)>,
    /// Gains of the first screening, best first.
    pub first_ranking: Vec<(EffectId, f64)>,
    pub dropped: Vec<(EffectId, String)>,
}

impl Selection {
    /// Goes on from another hypothesis.
    pub fn take(&mut self, tried: Tried) {
        (self.fitted, self.held_out, self.rms) = (tried.fitted, tried.held_out, tried.rms);
    }

    /// A cause that pays beside another can't stand for it, though by itself it did as much.
    pub fn tell_members_apart(&mut self) {
        let hypothesis = &self.fitted.point.hypothesis;
        self.ambiguous.iter_mut().for_each(|(_, others)| others.retain(|id| !hypothesis.has(*id)));
        self.ambiguous.retain(|(_, others)| !others.is_empty());
    }

    /// Samples that were fitted.
    pub fn samples(&self) -> f64 {
        self.fitted.groups.iter().map(|group| group.count).sum::<f64>().max(1.0)
    }

    /// What the causes explain on what they were not fitted on, as a mean square in parts of the noise's.
    pub fn explained(&self) -> f64 {
        (self.held_out_first.total() - self.held_out.total()) / self.samples()
    }

    /// The part of what is beyond noise that the causes explain on what they were not fitted on.
    pub fn share_explained(&self, loss: Loss) -> f64 {
        let groups = &self.fitted.groups;
        let first = self.held_out_first.each(groups);
        let pairs = first.zip(&self.held_out.squares).map(|((first, count), now)| (first, *now, count));
        loss.share_explained(pairs)
    }
}

/// What was decided in one round.
#[derive(Debug, Clone)]
pub(crate) struct Round {
    pub rms_before: f64,
    /// Name and held-out RMS of every rival that was fitted, best first.
    pub rivals: Vec<(EffectId, f64)>,
    /// The names that can't be told apart from the best; empty where it stands alone.
    pub equals: Vec<EffectId>,
    pub accepted: Option<EffectId>,
}

//! The state of the search for causes: what is accepted so far, and what each round decided.

use crate::extend::hypothesis::Member;
use crate::fit::gauss_newton::Fitted;
use crate::name::forms::Forms;
use crate::name::tried::Tried;
use crate::numerics::gram::HeldOut;
use crate::numerics::loss::Loss;
use std::collections::BTreeSet;
use valve_model::EffectId;

/// The accepted causes, fitted, and how the search found them.
#[derive(Debug, Clone)]
pub(crate) struct Selection {
    pub fitted: Fitted,
    pub held_out: HeldOut,
    pub rms_first: f64,
    pub rms: f64,
    /// Held-out squares without any cause.
    pub held_out_first: HeldOut,
    pub forms: Forms,
    pub rounds: Vec<Round>,
    /// Groups of effects that these data can't tell apart: the one that is fitted as the group's representative, and the others.
    pub ambiguous: Vec<(EffectId, Vec<EffectId>)>,
    /// The others of those groups, fitted in place of their representative, whose id is the first element.
    pub alternatives: Vec<(EffectId, Member)>,
    /// For each such pair, the angle between the changes that the two make to the prediction, degrees.
    pub angles: Vec<(EffectId, EffectId, f64)>,
    /// Gains of the first screening, best first.
    pub first_ranking: Vec<(EffectId, f64)>,
    pub dropped: Vec<(EffectId, String)>,
}

impl Selection {
    /// Takes over another fitted hypothesis.
    pub fn take(&mut self, tried: Tried) {
        (self.fitted, self.held_out, self.rms) = (tried.fitted, tried.held_out, tried.rms);
    }

    /// Notes why a candidate is refused, whatever it gains.
    pub fn refuse(&mut self, id: EffectId, reason: &str) {
        if !self.dropped.iter().any(|(of, _)| *of == id) {
            self.dropped.push((id, reason.to_owned()));
        }
    }

    /// Removes accepted causes from each other's ambiguous groups: a cause that lowers the held-out error beside
    /// another is distinguishable from it, even if either alone fitted equally well.
    pub fn tell_members_apart(&mut self) {
        let hypothesis = &self.fitted.point.hypothesis;
        self.ambiguous.iter_mut().for_each(|(_, others)| others.retain(|id| !hypothesis.has(*id)));
        self.ambiguous.retain(|(_, others)| !others.is_empty());
    }

    /// Counts what it explains from where `first` begins, a selection without causes.
    pub fn begin_from(&mut self, first: &Self) {
        (self.rms_first, self.held_out_first) = (first.rms_first, first.held_out_first.clone());
    }

    /// Whether it has all of the other's causes and more: what a search had found when it was ended.
    pub fn has_more_than(&self, other: &Self) -> bool {
        is_more(&self.ids(), &other.ids())
    }

    /// The causes that are accepted.
    pub fn ids(&self) -> BTreeSet<EffectId> {
        self.fitted.point.hypothesis.members.iter().map(|of| of.candidate.id).collect()
    }

    /// How many causes are accepted.
    pub fn causes(&self) -> usize {
        self.fitted.point.hypothesis.members.len()
    }

    /// The same without a transducer's lateness.
    pub fn causes_of_the_valve(&self) -> usize {
        let members = &self.fitted.point.hypothesis.members;
        members.iter().filter(|of| of.candidate.id != EffectId::SensorDelay).count()
    }

    /// Samples that were fitted.
    pub fn samples(&self) -> f64 {
        self.fitted.groups.iter().map(|group| group.count).sum::<f64>().max(1.0)
    }

    /// The held-out mean square that the causes explain, relative to the noise variance.
    pub fn explained(&self) -> f64 {
        (self.held_out_first.total() - self.held_out.total()) / self.samples()
    }

    /// The share of the held-out residual beyond noise that the causes explain. `noise`: the noise's share of a sample's error variance; the
    /// rest of that is misfit.
    pub fn share_explained(&self, loss: Loss, noise: f64) -> f64 {
        let groups = &self.fitted.groups;
        let first = self.held_out_first.each(groups);
        let pairs =
            first.zip(&self.held_out.squares).map(|((first, count), now)| (first, *now, noise * count));
        loss.share_explained(pairs)
    }
}

/// One round of the search: the candidates fitted, and the decision.
#[derive(Debug, Clone)]
pub(crate) struct Round {
    pub rms_before: f64,
    /// Name and held-out RMS of every rival that was fitted, best first.
    pub rivals: Vec<(EffectId, f64)>,
    /// The effects that can't be told apart from the accepted one.
    pub equals: Vec<EffectId>,
    pub accepted: Option<EffectId>,
    /// Held-out RMS with the accepted one.
    pub rms_after: f64,
    /// What competed with it, as fitted.
    pub others: Vec<Member>,
}

/// Whether these causes are all of the others and more.
fn is_more(causes: &BTreeSet<EffectId>, others: &BTreeSet<EffectId>) -> bool {
    causes.is_superset(others) && causes.len() > others.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_that_was_ended_is_less_if_another_has_its_causes_and_more() {
        let (late, level, play) = (EffectId::SensorDelay, EffectId::CoulombLevel, EffectId::Backlash);
        let table: [(&[EffectId], &[EffectId], bool); 7] = [
            (&[], &[], false),
            (&[late], &[], true),
            (&[], &[late], false),
            (&[late], &[late], false),
            (&[late, level], &[late], true),
            (&[late], &[late, level], false),
            (&[late, level], &[play], false),
        ];
        for (causes, others, expected) in table {
            let set = |of: &[EffectId]| of.iter().copied().collect();
            assert_eq!(is_more(&set(causes), &set(others)), expected, "{causes:?} beside {others:?}");
        }
    }
}

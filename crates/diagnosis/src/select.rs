//! Which causes are accepted: rivals screened by sensitivities, fitted through the model, judged on runs that they were
//! not fitted on, one after the other; two that hide each other, together.

use crate::DiagnosisError;
use crate::candidate::Candidate;
use crate::fine::fit_finely;
use crate::fit::Fitted;
use crate::gram::HeldOut;
use crate::linear::Setting;
use crate::loss::Loss;
use crate::measure::left;
use crate::pair::{hidden_pair, leaves_less};
use crate::prune::{drop_idle, fit_earlier_ones, tell_asymmetry_from_offset};
use crate::refine::refine;
use crate::rivals::{Tried, judge};
use crate::round::{Round, next_cause};
use crate::screen::{Screening, screen};
use crate::simplify::simplify;
use crate::whiteness::is_white;
use crate::worth::{Forms, leaves_much_to_pick};

/// Causes at most.
const MOST: usize = 6;

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
    pub ambiguous: Vec<(&'static str, Vec<&'static str>)>,
    /// For each pair of names that can't be told apart, the angle between what they change, degrees.
    pub angles: Vec<(&'static str, &'static str, f64)>,
    /// Gains of the first screening, best first.
    pub first_ranking: Vec<(&'static str, f64)>,
    pub dropped: Vec<(&'static str, String)>,
}

impl Selection {
    /// Goes on from another hypothesis.
    pub fn take(&mut self, tried: Tried) {
        (self.fitted, self.held_out, self.rms) = (tried.fitted, tried.held_out, tried.rms);
    }

    /// A cause that pays beside another can't stand for it, though by itself it did as much.
    fn tell_members_apart(&mut self) {
        let hypothesis = &self.fitted.point.hypothesis;
        self.ambiguous.iter_mut().for_each(|(_, others)| others.retain(|id| !hypothesis.has(id)));
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

/// Who is told a ranking: the effects, and how well each explains the residual.
pub(crate) type Tell<'a> = dyn FnMut(&[(&'static str, f64)]) + 'a;

/// Looks for causes from `begin` on; those of `earlier` are in at first, and stay as far as they pay.
pub(crate) fn select(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    begin: Fitted,
    earlier: Option<&Selection>,
    tell: &mut Tell<'_>,
) -> Result<Selection, DiagnosisError> {
    let mut state = nothing_yet(setting, begin);
    if let Some(earlier) = earlier {
        take_over(setting, earlier, &mut state)?;
    }
    if is_white(setting, &left(setting, &state.fitted.point)?) {
        return Ok(state);
    }
    let first = screen(setting, candidates, &state.fitted)?;
    state.first_ranking = first.ranking(candidates);
    tell(&state.first_ranking);
    let begun = state.clone();
    grow(setting, candidates, &first, &mut state)?;
    if earlier.is_none()
        && let Some(mut pair) = hidden_pair(setting, candidates, &first, &begun, &state)?
    {
        settle(setting, candidates, &mut pair)?;
        grow_on(setting, candidates, &mut pair)?;
        // Once all is settled one of the two may have gone.
        if leaves_less(pair.rms, state.rms) {
            state = pair;
        }
    }
    state.tell_members_apart();
    Ok(state)
}

fn nothing_yet(setting: &Setting<'_>, begin: Fitted) -> Selection {
    let held_out = judge(setting, &begin.groups);
    let rms_first = Loss::of(setting).rms(held_out.each(&begin.groups));
    Selection {
        fitted: begin,
        held_out_first: held_out.clone(),
        held_out,
        rms_first,
        rms: rms_first,
        forms: Forms::default(),
        rounds: Vec::new(),
        ambiguous: Vec::new(),
        angles: Vec::new(),
        first_ranking: Vec::new(),
        dropped: Vec::new(),
    }
}

/// Takes causes, one after the other, the first from this screening.
fn grow(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    first: &Screening<'_>,
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    if next_cause(setting, candidates, &first.ranked, state)? {
        settle(setting, candidates, state)?;
        grow_on(setting, candidates, state)?;
    }
    Ok(())
}

/// Takes further causes, one after the other, as long as something is left and they pay.
fn grow_on(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    for _ in 1..MOST {
        let enough = state.fitted.point.hypothesis.members.len() >= MOST;
        if enough || is_white(setting, &left(setting, &state.fitted.point)?) {
            break;
        }
        let screening = screen(setting, candidates, &state.fitted)?;
        let before = state.fitted.point.hypothesis.members.len();
        if !next_cause(setting, candidates, &screening.ranked, state)? {
            break;
        }
        settle(setting, candidates, state)?;
        let as_many = state.fitted.point.hypothesis.members.len() <= before;
        if as_many && leaves_much_to_pick(state, Loss::of(setting)) {
            break;
        }
    }
    Ok(())
}

/// What a new cause changes, for itself and for the others.
fn settle(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    refine(setting, state)?;
    tell_asymmetry_from_offset(state);
    fit_earlier_ones(setting, state)?;
    fit_finely(setting, state)?;
    drop_idle(setting, state)?;
    simplify(setting, candidates, state)?;
    // Where one has gone.
    fit_finely(setting, state)
}

/// Begins with causes that were found before, fitted anew.
fn take_over(
    setting: &Setting<'_>,
    earlier: &Selection,
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    let tried = Tried::from(setting, earlier.fitted.point.clone(), 8)?;
    let members = &tried.fitted.point.hypothesis.members;
    if members.iter().any(|member| Forms::is_open(member.candidate.id)) {
        state.forms.open = earlier.forms.open.min(state.rms.powi(2) - tried.rms.powi(2)).max(0.0);
        state.forms.loose = earlier.forms.loose;
    }
    state.take(tried);
    state.ambiguous.clone_from(&earlier.ambiguous);
    state.angles.clone_from(&earlier.angles);
    state.rounds.clone_from(&earlier.rounds);
    drop_idle(setting, state)
}

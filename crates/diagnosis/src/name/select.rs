//! The search for causes: forward selection with screening, fitting and pruning in each round, then a search for pairs that hide
//! each other.

use crate::DiagnosisError;
use crate::extend::candidate::Candidate;
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::Fitted;
use crate::name::exchange::exchange;
use crate::name::fine::fit_finely;
use crate::name::forms::Forms;
use crate::name::pair::{hidden_pair, leaves_less};
use crate::name::prune::{drop_idle, fit_earlier_ones, tell_asymmetry_from_offset};
use crate::name::refine::refine;
use crate::name::round::next_cause;
use crate::name::screen::{Screening, screen};
use crate::name::selection::Selection;
use crate::name::simplify::simplify;
use crate::name::threshold::hysteresis_keeps_shrinking;
use crate::name::tried::{Tried, judge};
use crate::show::residual::left;
use crate::show::structure::{depends, structure};
use crate::show::whiteness::is_white;
use valve_model::EffectId;

/// Causes at most.
const MOST: usize = 6;

/// Receives a ranking: each effect with its linearised gain.
pub(crate) type Tell<'a> = dyn FnMut(&[(EffectId, f64)]) + 'a;

/// Searches for causes from the fit `begin`; starts with those of `earlier`, which are kept while they gain.
pub(crate) fn select(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    begin: Fitted,
    earlier: Option<&Selection>,
    tell: &mut Tell<'_>,
) -> Result<Selection, DiagnosisError> {
    let mut state = nothing_yet(setting, begin);
    if let Some(earlier) = earlier {
        let mut point = earlier.fitted.point.clone();
        point.hypothesis.corrections.clear();
        take_over(setting, earlier, point, &mut state)?;
    }
    if is_explained(setting, &state)? {
        return Ok(state);
    }
    let first = screen(setting, candidates, &state.fitted)?;
    state.first_ranking = first.ranking();
    tell(&state.first_ranking);
    let begun = state.clone();
    grow(setting, candidates, &first, &mut state)?;
    if earlier.is_none()
        && !setting.is_over()
        && let Some(mut pair) = hidden_pair(setting, candidates, &first, &begun, &state)?
    {
        settle(setting, candidates, &mut pair)?;
        grow_on(setting, candidates, &mut pair)?;
        // After pruning, one of the two may have been dropped.
        if leaves_less(pair.rms, state.rms) {
            state = pair;
        }
    }
    state.tell_members_apart();
    Ok(state)
}

/// Whether no further cause is to be searched for: the residual is white and, if a misfit counts as error, depends on no covariate.
fn is_explained(setting: &Setting<'_>, state: &Selection) -> Result<bool, DiagnosisError> {
    let left = left(setting, &state.fitted.point)?;
    Ok(is_white(setting, &left) && !(setting.campaign.has_misfit && depends(&structure(setting, &left))))
}

/// The state before any cause is accepted.
pub(crate) fn nothing_yet(setting: &Setting<'_>, begin: Fitted) -> Selection {
    let held_out = judge(setting, &begin);
    let rms_first = setting.loss().rms(held_out.each(&begin.groups));
    Selection {
        fitted: begin,
        held_out_first: held_out.clone(),
        held_out,
        rms_first,
        rms: rms_first,
        forms: Forms::default(),
        rounds: Vec::new(),
        ambiguous: Vec::new(),
        alternatives: Vec::new(),
        angles: Vec::new(),
        first_ranking: Vec::new(),
        dropped: Vec::new(),
    }
}

/// Accepts causes one after the other, the first from this screening.
fn grow(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    first: &Screening<'_>,
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    if next_cause(setting, &first.ranked, state)? {
        settle(setting, candidates, state)?;
        grow_on(setting, candidates, state)?;
    }
    Ok(())
}

/// Accepts further causes until the residual is white or none passes the threshold.
fn grow_on(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    for _ in 1..MOST {
        let enough = state.causes() >= MOST;
        if enough || setting.is_over() || is_explained(setting, state)? {
            break;
        }
        let screening = screen(setting, candidates, &state.fitted)?;
        let before = state.causes();
        if !next_cause(setting, &screening.ranked, state)? {
            break;
        }
        settle(setting, candidates, state)?;
        let as_many = state.causes() <= before;
        let accepted = state.rounds.last().and_then(|round| round.accepted);
        let dropped = accepted.is_some_and(|id| !state.fitted.point.hypothesis.has(id));
        if dropped || as_many && hysteresis_keeps_shrinking(state, setting.loss()) {
            break;
        }
    }
    Ok(())
}

/// Refines, refits, prunes and simplifies after a cause is accepted.
fn settle(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    refine(setting, state)?;
    tell_asymmetry_from_offset(state);
    exchange(setting, state, &[])?;
    fit_earlier_ones(setting, state)?;
    fit_finely(setting, state)?;
    drop_idle(setting, state)?;
    simplify(setting, candidates, state)?;
    // Again, in case a cause was dropped or replaced.
    fit_finely(setting, state)
}

/// Starts from causes that an earlier search accepted, fitted again from `point`.
pub(crate) fn take_over(
    setting: &Setting<'_>,
    earlier: &Selection,
    point: Point,
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    let tried = Tried::from(setting, point, 8)?;
    let members = &tried.fitted.point.hypothesis.members;
    if members.iter().any(|member| Forms::is_inexact(member.candidate.id)) {
        state.forms.inexact = earlier.forms.inexact.min(state.rms.powi(2) - tried.rms.powi(2)).max(0.0);
        state.forms.inexact_of_squares = earlier.forms.inexact_of_squares;
        state.forms.hysteresis = earlier.forms.hysteresis;
    }
    state.take(tried);
    state.ambiguous.clone_from(&earlier.ambiguous);
    state.angles.clone_from(&earlier.angles);
    state.alternatives.clone_from(&earlier.alternatives);
    state.rounds.clone_from(&earlier.rounds);
    drop_idle(setting, state)
}

//! Several parameters of the model that are off by more than their tolerance: a model of first guesses, compared with a record.

use crate::DiagnosisError;
use crate::alike::twins_in_place_of;
use crate::asked::Asked;
use crate::corrected::leaves_noise;
use crate::error::if_possible;
use crate::extend::hypothesis::{Correction, Hypothesis, Member};
use crate::extend::tolerance::corrections;
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::{Fitted, fit};
use crate::log::piece::Piece;
use crate::name::select::nothing_yet;
use crate::name::selection::{Round, Selection};
use crate::name::tried::{NEARLY, STEPS, Tried};
use valve_model::EffectId;

/// The relative standard deviation of a parameter that is a first guess: read from a plot or a data sheet.
pub(crate) const GUESSED: f64 = 0.3;

/// With all parameters free, the residual may be a little above noise if it is at most this fraction of the one with
/// corrections alone: a parameter that is not fitted (the bristles' damping) is a first guess too.
const LITTLE_MORE: f64 = 1.5;
const CUT_TO: f64 = 0.5;

/// Whether a fit leaves no more than noise, or little more and far less than the corrections within their tolerance.
fn explains(setting: &Setting<'_>, tried: &Tried, within: f64) -> Result<bool, DiagnosisError> {
    Ok(tried.rms < LITTLE_MORE.min(CUT_TO * within) || leaves_noise(setting, &tried.fitted)?)
}

/// The parameters that are off by more than their tolerance, as causes, if all parameters of the model together leave little
/// more than noise. `within` is the held-out RMS with the corrections alone, relative to the noise.
///
/// They are fitted all at once, because one after the other they are hard to find: each stands in for the others. The
/// transducer's scale is taken as given: beside all levels it can't be told from theirs.
pub(crate) fn numbers_off(
    setting: &Setting<'_>,
    asked: Asked<'_>,
    given: &Fitted,
    within: f64,
) -> Result<Option<Selection>, DiagnosisError> {
    let Some(free) = all_numbers_free(setting, asked, given)? else { return Ok(None) };
    let free = Tried::judged(setting, free);
    if !explains(setting, &free, within)? {
        return Ok(None);
    }
    let free = free.fitted;
    let found = free.point.hypothesis.corrections.iter();
    let off: Vec<(EffectId, f64)> = found
        .filter(|of| asked.corrections.iter().any(|known| known.id == of.id && !known.holds(of.value)))
        .map(|of| (of.id, of.value))
        .collect();
    let begin = Point { hypothesis: with_numbers(asked, given, &off), starts: free.point.starts };
    let Some(tried) = if_possible(Tried::from(setting, begin, STEPS))? else { return Ok(None) };
    if !explains(setting, &tried, within)? {
        return Ok(None);
    }
    let (tried, off) = those_needed(setting, (asked, given, within), (tried, off))?;
    let mut state = nothing_yet(setting, given.clone());
    for (id, _) in &off {
        let round = Round {
            rms_before: state.rms,
            rivals: vec![(*id, tried.rms)],
            equals: Vec::new(),
            accepted: Some(*id),
            rms_after: tried.rms,
            others: Vec::new(),
        };
        state.rounds.push(round);
    }
    let ids: Vec<EffectId> = off.iter().map(|(id, _)| *id).collect();
    for id in ids {
        let twins = twins_in_place_of(setting, asked.able, (id, &tried))?;
        let twins = twins.into_iter().filter(|(_, twin)| twin.rms <= tried.rms + NEARLY * tried.rms.max(1.0));
        let (alike, members): (Vec<EffectId>, Vec<_>) =
            twins.map(|(twin, tried)| (twin, tried.fitted.point.hypothesis.members.last().cloned())).unzip();
        if !alike.is_empty() {
            state.alternatives.extend(members.into_iter().flatten().map(|member| (id, member)));
            state.ambiguous.push((id, alike));
        }
    }
    state.take(tried);
    Ok(Some(state))
}

/// The given model fitted with all its parameters free as first guesses are, the transducer as given; `None` if the tolerance
/// is as wide already.
fn all_numbers_free(
    setting: &Setting<'_>,
    asked: Asked<'_>,
    given: &Fitted,
) -> Result<Option<Fitted>, DiagnosisError> {
    let is_level = |of: &&Correction| !of.id.is_of_transducer();
    let known: Vec<&Correction> = asked.corrections.iter().filter(is_level).collect();
    if known.len() < 2 || known.iter().any(|of| of.deviation >= GUESSED) || setting.is_over() {
        return Ok(None);
    }
    let guessed = corrections(&setting.campaign.facts, asked.able, GUESSED);
    let guessed: Vec<Correction> =
        guessed.into_iter().filter(|of| known.iter().any(|known| known.id == of.id)).collect();
    let hypothesis = Hypothesis { corrections: guessed, ..given.point.hypothesis.clone() };
    let begin = Point { hypothesis, starts: given.point.starts.clone() };
    if_possible(fit(setting, begin, &Piece::is_fitted, STEPS))
}

/// The given model with these parameters free, and corrections of the others.
fn with_numbers(asked: Asked<'_>, given: &Fitted, off: &[(EffectId, f64)]) -> Hypothesis {
    let is_free = |id: EffectId| off.iter().any(|(free, _)| *free == id);
    let within = |of: &&Correction| !is_free(of.id);
    let mut hypothesis = Hypothesis {
        corrections: asked.corrections.iter().filter(within).cloned().collect(),
        ..given.point.hypothesis.clone()
    };
    for (id, value) in off {
        let Some(candidate) = asked.able.iter().find(|candidate| candidate.id == *id) else { continue };
        hypothesis = hypothesis.with(Member::new(candidate, vec![*value], candidate.free.clone()));
    }
    hypothesis
}

/// The same with parameters back within their tolerance if the held-out error stays the same, those first that are off least.
fn those_needed(
    setting: &Setting<'_>,
    (asked, given, within): (Asked<'_>, &Fitted, f64),
    (mut kept, mut off): (Tried, Vec<(EffectId, f64)>),
) -> Result<(Tried, Vec<(EffectId, f64)>), DiagnosisError> {
    let most = kept.rms + NEARLY * kept.rms.max(1.0);
    off.sort_by(|a, b| (a.1 - 1.0).abs().total_cmp(&(b.1 - 1.0).abs()));
    let mut index = 0;
    while index < off.len() && off.len() > 1 && !setting.is_over() {
        let mut fewer = off.clone();
        fewer.remove(index);
        let begin = Point {
            hypothesis: with_numbers(asked, given, &fewer),
            starts: kept.fitted.point.starts.clone(),
        };
        match if_possible(Tried::from(setting, begin, STEPS))? {
            Some(tried) if tried.rms <= most && explains(setting, &tried, within)? => {
                (kept, off) = (tried, fewer);
            }
            _ => index += 1,
        }
    }
    Ok((kept, off))
}

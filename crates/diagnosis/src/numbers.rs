//! Several numbers of the model that are off by more than their tolerance: a first guess of a model, held against a record.

use crate::DiagnosisError;
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

/// How well the numbers of a first guess are known, one standard deviation: read from a plot or a data sheet.
const GUESSED: f64 = 0.3;

/// With all numbers free little more than noise may be left, where it is this part of what corrections leave at most: a number that is none of
/// those that are fitted (the bristles' damping) is a first guess too.
const LITTLE_MORE: f64 = 1.5;
const CUT_TO: f64 = 0.5;

/// Whether a fit leaves no more than noise, or little more and far less than the corrections within their tolerance do.
fn explains(setting: &Setting<'_>, tried: &Tried, within: f64) -> Result<bool, DiagnosisError> {
    Ok(tried.rms < LITTLE_MORE.min(CUT_TO * within) || leaves_noise(setting, &tried.fitted)?)
}

/// The numbers that are off by more than their tolerance as causes, where little more than noise is left with all numbers of the model free;
/// the corrections alone leave a held-out RMS of `within` times the noise.
///
/// Asked where few causes leave more: one after the other such numbers are hard to find, since each stands in for the others. The
/// transducer is taken as it reads: beside all levels its scale can't be told from theirs.
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
        };
        state.rounds.push(round);
    }
    state.take(tried);
    Ok(Some(state))
}

/// The given model with all its numbers free as first guesses are, the transducer as it reads; `None` where the tolerance is as wide already.
fn all_numbers_free(
    setting: &Setting<'_>,
    asked: Asked<'_>,
    given: &Fitted,
) -> Result<Option<Fitted>, DiagnosisError> {
    let is_level = |of: &&Correction| !matches!(of.id, EffectId::TorqueGain | EffectId::TorqueOffset);
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

/// The given model with these numbers free, and corrections of the others but for the transducer's scale.
fn with_numbers(asked: Asked<'_>, given: &Fitted, off: &[(EffectId, f64)]) -> Hypothesis {
    let is_free = |id: EffectId| off.iter().any(|(free, _)| *free == id);
    let within = |of: &&Correction| !is_free(of.id) && of.id != EffectId::TorqueGain;
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

/// The same with numbers back within their tolerance where the held-out error stays the same, those first that are off least.
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

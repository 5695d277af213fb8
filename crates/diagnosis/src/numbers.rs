//! Several parameters of the model that are off by more than their tolerance: a model of first guesses, compared with a record.

use crate::DiagnosisError;
use crate::alike::twins_in_place_of;
use crate::asked::Asked;
use crate::error::if_possible;
use crate::extend::hypothesis::{Correction, Free, Hypothesis, Member};
use crate::extend::tolerance::corrections;
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::{Fitted, fit};
use crate::fit::spread::spread;
use crate::log::piece::Piece;
use crate::measure::doubt::leaves_noise;
use crate::name::select::nothing_yet;
use crate::name::selection::{Round, Selection};
use crate::name::tried::{NEARLY, STEPS, Tried};
use crate::numerics::gram::invert;
use crate::numerics::statistics::CHANCE;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};
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

/// Whether the numbers are all off by one factor, as a transducer's scale takes them, each within its tolerance and what is not known of it: what they
/// differ by from the best common factor is no more than chance (Wald's test).
pub(crate) fn have_one_factor(
    setting: &Setting<'_>,
    numbers: &Selection,
    corrections: &[Correction],
) -> bool {
    let hypothesis = &numbers.fitted.point.hypothesis;
    let free = hypothesis.free();
    // The place of a member among what is free, its factor, and the variance that the tolerance leaves it.
    let scaled = |(index, member): (usize, &Member)| {
        let is_factor = member.candidate.parameters.first().is_some_and(|of| of.key == "factor");
        let number = Free::Number(index, 0);
        let place = free.iter().position(|of| *of == number)?;
        let tolerance = corrections.iter().find(|of| of.id == member.candidate.id)?.deviation;
        let factor = hypothesis.get(number);
        (is_factor && member.candidate.id != EffectId::StribeckVelocity).then_some((
            place,
            factor,
            (tolerance * factor).powi(2),
        ))
    };
    let scaled: Option<Vec<(usize, f64, f64)>> = hypothesis.members.iter().enumerate().map(scaled).collect();
    let Some(scaled) = scaled.filter(|scaled| scaled.len() > 1) else { return false };
    let Some(spread) = spread(&numbers.fitted, setting.loss()) else { return false };
    let places: Vec<usize> = scaled.iter().map(|of| of.0).collect();
    let factors = DVector::from_iterator(scaled.len(), scaled.iter().map(|of| of.1));
    let own = DVector::from_iterator(scaled.len(), scaled.iter().map(|of| of.2));
    let covariance =
        spread.covariance.select_rows(&places).select_columns(&places) + DMatrix::from_diagonal(&own);
    chance_of_one_factor(&factors, covariance) > CHANCE
}

/// Probability that factors with this covariance differ as much as these by chance; 0 if that can't be told.
fn chance_of_one_factor(factors: &DVector<f64>, covariance: DMatrix<f64>) -> f64 {
    let Some(inverse) = invert(covariance) else { return 0.0 };
    let common = (&inverse * factors).sum() / inverse.sum();
    let off = factors.add_scalar(-common);
    let statistic = (&inverse * &off).dot(&off);
    ChiSquared::new(factors.len() as f64 - 1.0).map_or(0.0, |chi| chi.sf(statistic))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_by_one_factor_are_told_by_their_errors() {
        // Factors, standard deviation of each, and whether they are one.
        for (factors, deviation, one) in [
            ([1.38, 1.44, 1.29], 0.055, true),
            ([1.38, 1.44, 1.29], 0.02, false),
            ([1.4, 1.4, 1.4], 0.01, true),
            ([1.4, 1.0, 1.4], 0.05, false),
        ] {
            let covariance = DMatrix::from_diagonal_element(3, 3, deviation * deviation);
            let chance = chance_of_one_factor(&DVector::from_row_slice(&factors), covariance);
            assert_eq!(chance > CHANCE, one, "{factors:?} with {deviation}: {chance}");
        }
    }

    #[test]
    fn errors_that_go_together_tell_more() {
        let factors = DVector::from_row_slice(&[1.4, 1.3]);
        let with = |together: f64| {
            chance_of_one_factor(
                &factors,
                DMatrix::from_row_slice(2, 2, &[1.0, together, together, 1.0]) * 0.0025,
            )
        };
        assert!(with(0.0) > CHANCE && with(0.9) < CHANCE, "{} and {}", with(0.0), with(0.9));
    }
}

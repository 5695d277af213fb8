//! The accepted causes: fitted values, intervals, and the held-out error without each.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::DiagnosisError;
use crate::extend::candidate::{Candidate, Parameter};
use crate::extend::hypothesis::{Correction, Free, Hypothesis, Member};
use crate::fit::equations::Point;
use crate::fit::gauss_newton::{Fitted, fit};
use crate::fit::spread::{Spread, spread};
use crate::log::piece::Piece;
use crate::measure::doubt::leaves_noise;
use crate::measure::judgement::Judgement;
use crate::measure::significance::{is_beyond, may_be_none};
use crate::name::fine::finer;
use crate::name::threshold::FLOOR;
use crate::numerics::loss::Loss;
use crate::outcome::{Cause, Corrected, Covariance, Evidence, IN_MODEL, ParameterFound, Parameters};
use crate::show::own_zeros::zeros_hold;
use crate::show::residual::{PieceResidual, judges_of, rms_as_fitted, rms_left};
use std::collections::BTreeMap;
use valve_model::{Effect, EffectId, EffectValue, Model};

/// A cause is harmful if removing it lowers the held-out error by more than this share.
const HARMFUL: f64 = -0.02;

/// A cause that is a parameter of the model, and the only one, stays accepted if a refit with it within its tolerance has a held-out error larger
/// by this share, however wide its interval, up to where no more was tried: parameters that compensate each other have wide intervals. Any other
/// cause is dropped if its interval contains zero effect: any curve over the angle cuts the error of a log whose pressure was not recorded.
const INDISPENSABLE: f64 = 0.02;
/// Beside other causes a parameter of the model must be worth this share, however narrow its interval, and its interval must leave out no
/// change at all: of two that compensate each other the other one stays. One that may be right makes up for what
/// is not quite right in their forms, a late transducer above all, and cuts some per cent of what they leave. Rivals that differ by less
/// than a tenth count as equal there too. Where all of them leave no more than noise their forms are right: what counts is then whether
/// it is beyond its tolerance by more than chance.
const INDISPENSABLE_BESIDE: f64 = 0.1;

/// Without a cause the held-out error must be larger by this share where it acts, or there is no evidence for it: an interval can exclude zero
/// effect because the other causes' forms are not quite right. As much as the search asks of a cause in multiples of the noise.
const NEEDED: f64 = FLOOR;

/// The accepted part of a selection.
pub(crate) struct Accepted {
    pub point: Point,
    /// The residual, by piece.
    pub after: Vec<PieceResidual>,
    pub causes: Vec<Cause>,
    /// Numbers of the model corrected within their tolerance.
    pub corrected: Vec<Corrected>,
    pub covariance: Covariance,
    /// Causes that were dropped as harmful.
    pub harmful: Vec<EffectId>,
    /// Causes that were dropped because none of their amplitudes differs significantly from zero effect, or because the held-out
    /// error is as small without them.
    pub unclear: Vec<EffectId>,
}

/// A cause with its gain in held-out error.
struct Weighed {
    cause: Cause,
    /// The share of the held-out error without it, by the loss of the fit, that it removes.
    worth: f64,
    /// The same where it acts, on the runs held out that show it: what it does in a few runs is no less for the many in which it does nothing.
    acting: f64,
}

/// Fits the members with these indices. Drops any that is harmful beside the others, or not significantly different from zero
/// effect. `all` is the whole selection's point and residual.
pub(crate) fn accept(
    judged: &Judgement<'_>,
    mut members: Vec<usize>,
    all: (Point, Vec<PieceResidual>),
) -> Result<Accepted, DiagnosisError> {
    let (mut harmful, mut unclear) = (Vec::new(), Vec::new());
    let mut all = Some(all);
    loop {
        let kept = keep(judged, &members)?;
        let whole = members.len() == judged.selection.causes();
        let (point, after) = match all.take() {
            Some(all) if whole => all,
            _ => judged.everywhere(&kept)?,
        };
        let errors = errors_of(judged, &kept)?;
        let weighed = weigh(judged, &kept, &after, &errors)?;
        let least = |a: &usize, b: &usize| weighed[*a].worth.total_cmp(&weighed[*b].worth);
        let mut vague = Vec::new();
        for (index, weighed) in weighed.iter().enumerate() {
            if is_vague(judged, (&kept, &errors), index, weighed)? {
                vague.push(index);
            }
        }
        if let Some(vague) = vague.into_iter().min_by(least) {
            unclear.push(weighed[vague].cause.id);
            members.remove(vague);
            continue;
        }
        let worst = (0..weighed.len()).min_by(least);
        let Some(worst) = worst.filter(|worst| weighed.len() > 1 && weighed[*worst].worth < HARMFUL) else {
            let causes = weighed.into_iter().map(|of| of.cause).collect();
            let (corrected, covariance) = (errors.corrected(), errors.covariance());
            return Ok(Accepted { point, after, causes, corrected, covariance, harmful, unclear });
        };
        harmful.push(weighed[worst].cause.id);
        members.remove(worst);
    }
}

/// Whether there is too little evidence for the member at this index.
fn is_vague(
    judged: &Judgement<'_>,
    (kept, errors): (&Fitted, &Errors),
    index: usize,
    weighed: &Weighed,
) -> Result<bool, DiagnosisError> {
    let Weighed { worth, acting, .. } = *weighed;
    let members = &kept.point.hypothesis.members;
    let is_own = |of: &&Correction| members.get(index).is_some_and(|member| member.candidate.id == of.id);
    let tolerance = judged.corrections.iter().find(is_own);
    let spread = errors.spread.as_ref().map(|spread| (&errors.hypothesis, spread));
    let none = || {
        let smooth = judged.setting.campaign.kind.smooth;
        spread.is_some_and(|spread| may_be_none(spread, index, tolerance.is_some(), smooth))
    };
    Ok(match tolerance {
        Some(tolerance) if members.len() > 1 => {
            let beyond = || spread.is_some_and(|spread| is_beyond(spread, index, tolerance));
            let indispensable = worth >= INDISPENSABLE_BESIDE && !none();
            !indispensable && (acting < NEEDED || !beyond() || !leaves_noise(&judged.setting, kept)?)
        }
        // Maybe none at all, and maybe all that was tried: no size of it is the cause.
        Some(_) if worth > INDISPENSABLE => reaches_bound(errors, index) && none(),
        _ => acting < NEEDED || none(),
    })
}

/// Whether the 95 % interval of a member's first number reaches the end of what was tried.
fn reaches_bound(Errors { hypothesis, spread }: &Errors, index: usize) -> bool {
    let first = Free::Number(index, 0);
    let Some(of) = hypothesis.members.get(index).and_then(|member| member.candidate.parameters.first())
    else {
        return false;
    };
    let half = hypothesis.place_of(first).zip(spread.as_ref()).map_or(f64::INFINITY, |(place, spread)| {
        spread.half_width * spread.covariance[(place, place)].max(0.0).sqrt()
    });
    let value = hypothesis.get(first);
    value - half <= of.lower || value + half >= of.upper
}

/// The best of each ambiguous group, if there is too little evidence for it: there is then none for any cause of the group.
/// `after` is what all selected causes leave.
pub(crate) fn vague_groups(
    judged: &Judgement<'_>,
    after: &[PieceResidual],
) -> Result<Vec<EffectId>, DiagnosisError> {
    let selection = &judged.selection;
    if selection.ambiguous.is_empty() {
        return Ok(Vec::new());
    }
    let fitted = &selection.fitted;
    let errors = errors_of(judged, fitted)?;
    let mut vague = Vec::new();
    for (index, member) in fitted.point.hypothesis.members.iter().enumerate() {
        let id = member.candidate.id;
        if selection.ambiguous.iter().any(|(best, _)| *best == id) {
            let weighed = weigh_one(judged, fitted, (after, &errors), index)?;
            vague.extend(is_vague(judged, (fitted, &errors), index, &weighed)?.then_some(id));
        }
    }
    Ok(vague)
}

/// The fit of the accepted members; a new one if some are left out.
fn keep(judged: &Judgement<'_>, accepted: &[usize]) -> Result<Fitted, DiagnosisError> {
    let fitted = &judged.selection.fitted;
    if accepted.len() == fitted.point.hypothesis.members.len() {
        return Ok(fitted.clone());
    }
    let members: Vec<Member> =
        accepted.iter().filter_map(|index| fitted.point.hypothesis.members.get(*index).cloned()).collect();
    let hypothesis = Hypothesis { members, ..judged.without_causes() };
    let mut hypothesis = corrected_again(hypothesis, judged, &fitted.point.hypothesis);
    // Without any cause, corrections would stand in for the causes that are not accepted, unless they leave nothing to explain.
    if hypothesis.members.is_empty() && !hypothesis.corrections.is_empty() {
        let begin = Point { hypothesis: hypothesis.clone(), starts: fitted.point.starts.clone() };
        let corrected = fit(&judged.setting, begin, &Piece::is_fitted, 8)?;
        if leaves_noise(&judged.setting, &corrected)? {
            return Ok(corrected);
        }
        hypothesis.corrections.clear();
    }
    let begin = Point { hypothesis, starts: fitted.point.starts.clone() };
    fit(&judged.setting, begin, &Piece::is_fitted, 8)
}

/// `fewer` with those parameters of the model corrected within their tolerance that are causes in `before` alone: they may be off anyway.
fn corrected_again(mut fewer: Hypothesis, judged: &Judgement<'_>, before: &Hypothesis) -> Hypothesis {
    let again = judged.corrections.iter().filter(|of| before.has(of.id) && !fewer.has(of.id));
    let again: Vec<_> = again.cloned().collect();
    fewer.corrections.extend(again);
    fewer
}

/// Each member's cause, in order.
fn weigh(
    judged: &Judgement<'_>,
    kept: &Fitted,
    after: &[PieceResidual],
    errors: &Errors,
) -> Result<Vec<Weighed>, DiagnosisError> {
    (0..kept.point.hypothesis.members.len())
        .map(|index| weigh_one(judged, kept, (after, errors), index))
        .collect()
}

/// The cause at an index, against a refit without it. `after`: what is left with all of them.
fn weigh_one(
    judged: &Judgement<'_>,
    kept: &Fitted,
    (after, errors): (&[PieceResidual], &Errors),
    index: usize,
) -> Result<Weighed, DiagnosisError> {
    let hypothesis = &kept.point.hypothesis;
    let member = &hypothesis.members[index];
    let fewer = corrected_again(hypothesis.without(index), judged, hypothesis);
    let begin = Point { hypothesis: fewer, starts: kept.point.starts.clone() };
    let without = fit(&judged.setting, begin, &Piece::is_fitted, 6)?;
    let (_, left) = judged.everywhere(&without)?;
    let (setting, judges) = (&judged.setting, judged.setting.campaign.judges());
    let all = rms_left(setting, after, &judges);
    let rms = rms_left(setting, &left, &judges);
    let removed = |wanted: &dyn Fn(&Piece) -> bool| {
        part_taken(rms_as_fitted(setting, after, &wanted), rms_as_fitted(setting, &left, &wanted))
    };
    // Zeros of each run hide what is missing without it, and are then none.
    let stood_in_for = !zeros_hold(setting, &without.point)? && zeros_hold(setting, &kept.point)?;
    let (worth, acting) = if stood_in_for {
        (1.0, 1.0)
    } else {
        (removed(&judges), removed(&judges_of(setting, &left, after)))
    };
    let mut evidence = BTreeMap::new();
    evidence.insert("rms_without_nm_or_rad".to_owned(), Evidence::Number(rms));
    if [EffectId::DwellStiction, EffectId::HydraulicLock].contains(&member.candidate.id) {
        let longest_s = judged.setting.campaign.facts.longest_rest_s;
        evidence.insert("longest_rest_s".to_owned(), Evidence::Number(longest_s));
    }
    if member.candidate.id == EffectId::WearDrift {
        let travelled_rad = judged.setting.campaign.facts.travel_rad;
        evidence.insert("travelled_rad".to_owned(), Evidence::Number(travelled_rad));
    }
    if let Some(numbers) = in_model(judged.setting.given, member.candidate.id) {
        evidence.insert(IN_MODEL.to_owned(), Evidence::Numbers(numbers));
    }
    if let Some(text) = taken(member) {
        evidence.insert("taken".to_owned(), Evidence::Text(text));
    }
    let cause = Cause {
        id: member.candidate.id,
        parameters: parameters(errors, index),
        evidence,
        rms_gain: part_taken(all, rms),
    };
    Ok(Weighed { cause, worth, acting })
}

/// The representative of each group of twins, with its parameters.
pub(crate) fn best_of_groups(judged: &Judgement<'_>) -> Result<Vec<(Effect, Parameters)>, DiagnosisError> {
    let all = members_with_numbers(judged)?;
    let of = |(best, _): &(EffectId, Vec<EffectId>)| {
        let own = all.iter().find(|(_, effect, _)| effect.id() == *best);
        own.map(|(_, effect, parameters)| (effect.clone(), parameters.clone()))
    };
    Ok(judged.selection.ambiguous.iter().filter_map(of).collect())
}

/// All selected causes with their parameters, by their indices.
pub(crate) fn members_with_numbers(
    judged: &Judgement<'_>,
) -> Result<Vec<(usize, Effect, Parameters)>, DiagnosisError> {
    let errors = errors_of(judged, &judged.selection.fitted)?;
    let of = |(index, member): (usize, &Member)| {
        let effect = member.candidate.effect(judged.setting.given, &member.numbers).ok()?;
        Some((index, effect, parameters(&errors, index)))
    };
    Ok(errors.hypothesis.members.iter().enumerate().filter_map(of).collect())
}

/// The uncertainty of a fit's numbers. Every correction counts as uncertain, whether it was moved or not.
pub(crate) struct Errors {
    pub hypothesis: Hypothesis,
    pub spread: Option<Spread>,
}

impl Errors {
    /// The corrections that are large enough to be reported.
    pub fn corrected(&self) -> Vec<Corrected> {
        corrected(&self.hypothesis, self.spread.as_ref())
    }

    /// The covariance of everything that was fitted, in the units of the model file.
    pub fn covariance(&self) -> Covariance {
        self.spread.as_ref().map(|spread| covariance(&self.hypothesis, spread)).unwrap_or_default()
    }
}

/// The covariance of a fit's numbers, with the errors of the motion and of the selection.
pub(crate) fn errors_of(judged: &Judgement<'_>, fitted: &Fitted) -> Result<Errors, DiagnosisError> {
    let setting = &judged.setting;
    let hypothesis = fitted.point.hypothesis.with_corrections_free();
    let at = |hypothesis: Hypothesis| {
        let point = Point { hypothesis, starts: fitted.point.starts.clone() };
        fit(setting, point, &Piece::is_fitted, 0)
    };
    let mut free = if hypothesis == fitted.point.hypothesis { fitted.clone() } else { at(hypothesis)? };
    if setting.loss() == Loss::OwnNoise {
        let finer = finer(&free, setting.loss());
        if finer != free.point.hypothesis {
            free = at(finer)?;
        }
    }
    let spread = match spread(&free, setting.loss()) {
        Some(spread) if !free.point.hypothesis.members.is_empty() => {
            Some(spread.with_motion(setting, &free, judged.seed)?.with_choice(setting, &free)?)
        }
        spread => spread,
    };
    Ok(Errors { hypothesis: free.point.hypothesis, spread })
}

/// A correction is reported if it exceeds `CLEAR` standard errors or `MOVED` of its tolerance, whichever is less. The
/// second is for correlated corrections: each is uncertain, their joint effect is not.
const CLEAR: f64 = 2.0;
const MOVED: f64 = 1.0 / 3.0;

fn corrected(hypothesis: &Hypothesis, spread: Option<&Spread>) -> Vec<Corrected> {
    let free = hypothesis.free().into_iter().enumerate();
    let each = free.filter_map(|(place, free)| {
        let Free::Correction(index) = free else { return None };
        let of = hypothesis.corrections.get(index)?;
        let std_error = spread?.covariance[(place, place)].max(0.0).sqrt();
        let half = spread?.half_width * std_error;
        let found = ParameterFound {
            value: of.value,
            std_error,
            ci95: [of.value - half, of.value + half],
            unit: Candidate::unit(of.key, of.id).to_owned(),
        };
        let clear = (of.value - of.neutral).abs() > (CLEAR * std_error).min(MOVED * of.deviation);
        clear.then(|| Corrected { id: of.id, key: of.key.to_owned(), at_bound: of.is_at_bound(), found })
    });
    each.collect()
}

fn covariance(hypothesis: &Hypothesis, spread: &Spread) -> Covariance {
    let free = hypothesis.free();
    let named = |free: &Free| match *free {
        Free::Zero => ("angle_zero_rad".to_owned(), 1.0),
        Free::Correction(index) => {
            let of = hypothesis.corrections.get(index);
            let name = of.map_or(String::new(), |of| format!("within_tolerance.{}.{}", of.id.name(), of.key));
            (name, 1.0)
        }
        Free::Number(member, number) => {
            let of = hypothesis.members.get(member);
            let parameter = of.and_then(|of| of.candidate.parameters.get(number)).zip(of);
            parameter.map_or((String::new(), 1.0), |(parameter, of)| {
                let slot = parameter.slot.map_or(String::new(), |slot| format!("[{}]", slot + 1));
                let name = format!("{}.{}{slot}", of.candidate.id.name(), parameter.key);
                (name, parameter.map.slope(hypothesis.get(*free)))
            })
        }
    };
    let (of, slopes): (Vec<String>, Vec<f64>) = free.iter().map(named).unzip();
    let row = |one: usize| {
        (0..slopes.len()).map(|two| slopes[one] * spread.covariance[(one, two)] * slopes[two]).collect()
    };
    Covariance { of, matrix: (0..slopes.len()).map(row).collect() }
}

/// The share of the residual that is removed.
fn part_taken(left: f64, without: f64) -> f64 {
    if without > 0.0 { 1.0 - left / without } else { 0.0 }
}

/// A member's fitted parameters, by key.
pub(crate) fn parameters(errors: &Errors, index: usize) -> Parameters {
    let Errors { hypothesis, spread } = errors;
    let spread = spread.as_ref();
    let Some(member) = hypothesis.members.get(index) else { return BTreeMap::new() };
    let free = hypothesis.free().into_iter().enumerate();
    let own = free.filter_map(|(place, free)| match free {
        Free::Number(of, number) if of == index => Some((place, number)),
        _ => None,
    });
    let found = own.filter_map(|(place, number)| {
        let deviation = spread.map_or(f64::NAN, |spread| spread.covariance[(place, place)].max(0.0).sqrt());
        parameter(member, number, deviation, spread.map_or(f64::NAN, |spread| spread.half_width))
    });
    let parameters = found.collect();
    if member.candidate.id == EffectId::EncoderEccentricity {
        return eccentricity(member, &parameters);
    }
    parameters
}

/// The numbers that an effect has in the given model; `None` if that has none of it.
fn in_model(given: &Model, id: EffectId) -> Option<BTreeMap<String, f64>> {
    let effect = given.effects.iter().find(|effect| effect.id() == id)?;
    let number = |(key, value): (&str, &EffectValue)| match value {
        EffectValue::Number(value) => Some((key.to_owned(), *value)),
        _ => None,
    };
    Some(effect.parts().filter_map(number).collect())
}

/// Parameters that were not fitted because the data give no reason to, with their default values.
fn taken(member: &Member) -> Option<String> {
    let parameters = member.candidate.parameters.iter().zip(&member.numbers).enumerate();
    let held = parameters.filter(|(number, (of, _))| of.slot.is_none() && !member.free.contains(number));
    let told: Vec<String> =
        held.map(|(_, (of, u))| format!("{} = {:.4}", of.key, of.map.value(*u))).collect();
    (!told.is_empty()).then(|| format!("default value, not fitted: {}", told.join(", ")))
}

fn parameter(
    member: &Member,
    number: usize,
    deviation: f64,
    half_width: f64,
) -> Option<(String, ParameterFound)> {
    let of = member.candidate.parameters.get(number)?;
    let u = member.numbers.get(number).copied()?;
    let value = of.map.value(u);
    // The interval ends at the parameter's bounds: values beyond them were not tried.
    let end = |u: f64| of.map.value(u.clamp(of.lower, of.upper));
    let (one, two) = (end(u - half_width * deviation), end(u + half_width * deviation));
    let found = ParameterFound {
        value,
        std_error: of.map.slope(u) * deviation,
        ci95: [one.min(two), one.max(two)],
        unit: member.candidate.unit_of(of.key.as_str()).to_owned(),
    };
    Some((name_of(of), found))
}

/// A parameter's name, with its place in a list.
fn name_of(of: &Parameter) -> String {
    of.slot.map_or_else(|| of.key.to_string(), |slot| format!("{}[{}]", of.key, slot + 1))
}

/// Amplitude and phase from the sine and cosine parts.
fn eccentricity(member: &Member, parts: &Parameters) -> Parameters {
    let number = |index: usize| member.numbers.get(index).copied().unwrap_or(0.0);
    let (along, across) = (number(0), number(1));
    let amplitude = along.hypot(across);
    let first = parts.values().next();
    let error = first.map_or(f64::NAN, |part| part.std_error);
    let half = first.map_or(f64::NAN, |part| 0.5 * (part.ci95[1] - part.ci95[0]));
    let phase = across.atan2(along);
    let per = 1.0 / amplitude.max(f64::MIN_POSITIVE);
    let found = |value: f64, error: f64, half: f64, unit: &str| ParameterFound {
        value,
        std_error: error,
        ci95: [value - half, value + half],
        unit: unit.to_owned(),
    };
    BTreeMap::from([
        ("amplitude_rad".to_owned(), found(amplitude, error, half, "rad")),
        ("phase_rad".to_owned(), found(phase, error * per, half * per, "rad")),
    ])
}

//! Whether no cause, or few, explain a log beside corrections of the model's numbers, and whether these stay beside what a full search finds.

use crate::DiagnosisError;
use crate::alike::{if_noise_is_left, twins_in_place_of, with_member};
use crate::asked::Asked;
use crate::corrected::{CORRECTING, with_corrections};
use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::{Correction, Member};
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::Fitted;
use crate::measure::doubt::{is_noise, leaves_noise};
use crate::name::apart::CLEARLY_MORE;
use crate::name::exchange::exchange;
use crate::name::forms::MISFIT;
use crate::name::late::{drop_idle_transducer, least_of_forms, with_late_transducer_alone};
use crate::name::prune::tell_asymmetry_from_offset;
use crate::name::refine::refine;
use crate::name::round::next_cause;
use crate::name::screen::screen;
use crate::name::select::{Tell, nothing_yet, take_over};
use crate::name::selection::{Round, Selection};
use crate::name::simplify::simplify;
use crate::name::tried::{EQUAL, NEARLY, STEPS, Tried};
use crate::numbers::{have_one_factor, numbers_off};
use crate::show::mains::mains;
use crate::show::residual::left;
use crate::show::structure::structure;
use crate::zeros::Reached;
use log_data::quantile;
use valve_model::EffectId;

/// Causes that are searched for beside corrections.
const FEW: usize = 2;
/// A candidate whose predicted residual RMS, or that after its first steps, is more than this many times the noise is not fitted further.
const HOPELESS: f64 = 1.5;

/// In the channel's own unit, residuals larger than this quantile of their sizes count as no larger than it.
const NOT_FAR_OUT: f64 = 0.98;

/// Whether no cause, or few, explain the log beside corrections.
pub(crate) enum Few {
    /// They leave no more than noise.
    Found(Box<Selection>),
    /// They leave more: the causes found so far, if any were searched for.
    Not(Option<Box<Selection>>),
}

impl Few {
    /// The point with the causes found; without any, the given model's, with its numbers corrected where these are.
    pub fn point<'a>(&'a self, (given, corrected): &'a (Fitted, Option<Fitted>)) -> &'a Point {
        let causes = match self {
            Self::Found(found) | Self::Not(Some(found)) => Some(&found.fitted).filter(|_| found.causes() > 0),
            Self::Not(None) => None,
        };
        &causes.or(corrected.as_ref()).unwrap_or(given).point
    }
}

/// No cause if corrections alone leave no more than noise; else few causes, if they do beside corrections. Corrections that
/// reach noise only at their bounds are compared with a single parameter beyond its tolerance.
pub(crate) fn few(
    setting: &Setting<'_>,
    asked: Asked<'_>,
    (given, corrected): (&Fitted, Option<&Fitted>),
    earlier: Option<&Selection>,
    ranked: &mut Tell<'_>,
) -> Result<Few, DiagnosisError> {
    let Some(corrected) = corrected else { return Ok(Few::Not(None)) };
    let found = |selection: Selection| Ok(Few::Found(Box::new(selection)));
    let within = leaves_noise(setting, corrected)?;
    let mut nothing = || {
        let cause = in_place_of_colour(setting, asked.able, (given, corrected), ranked)?;
        found(cause.unwrap_or_else(|| nothing_yet(setting, given.clone())))
    };
    if within && !corrected.point.hypothesis.corrections.iter().any(Correction::is_at_bound) {
        return nothing();
    }
    // The result is fitted again later, with exact sensitivities.
    let kept = setting.sensitivities(&corrected.point)?;
    let setting = &Setting { kept: kept.as_ref(), ..*setting };
    let rms = Tried::judged(setting, corrected.clone()).rms;
    // If the corrections leave noise, a parameter beyond its tolerance must leave less.
    let least = if within { rms - EQUAL } else { f64::INFINITY };
    let beyond = beyond_tolerance(setting, asked.able, (given, corrected), least)?;
    if within && beyond.is_none() {
        return nothing();
    }
    let again = match earlier {
        Some(earlier) => earlier_ones(setting, earlier, (given, corrected))?,
        None => None,
    };
    if let Some(one) = least_left(beyond, again) {
        return found(one);
    }
    // Far above noise: if several parameters of the model alone explain the residual, only a single cause in place of them all
    // is a smaller assumption.
    let numbers = if rms > HOPELESS { numbers_off(setting, asked, given, rms)? } else { None };
    let causes = if numbers.is_some() { 1 } else { FEW };
    let few = few_beside_corrections(setting, asked.able, (given, corrected), causes, ranked)?;
    Ok(match (few, numbers) {
        (Few::Not(Some(one)), Some(numbers))
            if is_simpler(Reached::of(&one), Reached::of(&numbers))
                || is_their_scale(setting, &one, &numbers, asked.corrections) =>
        {
            Few::Found(one)
        }
        (Few::Not(_), Some(numbers)) => Few::Found(Box::new(numbers)),
        (few, _) => few,
    })
}

/// Few causes that leave plain noise where corrections leave coloured noise. Noise that is slower than the sampling looks like what a cause leaves
/// that acts seldom, as at a break-away; but no cause takes its colour away on runs that nothing was fitted on. A lead is no such cause: no sensor
/// is early, and an encoder's steps that went through bristles are alike in front of where they are seen.
fn in_place_of_colour(
    setting: &Setting<'_>,
    able: &[Candidate],
    (given, corrected): (&Fitted, &Fitted),
    ranked: &mut Tell<'_>,
) -> Result<Option<Selection>, DiagnosisError> {
    let is_plain = |fitted: &Fitted| {
        Ok::<_, DiagnosisError>(is_noise(&structure(setting, &left(setting, &fitted.point)?)))
    };
    if is_plain(corrected)? {
        return Ok(None);
    }
    let Few::Found(few) = few_beside_corrections(setting, able, (given, corrected), FEW, ranked)? else {
        return Ok(None);
    };
    Ok((!few.fitted.point.hypothesis.has_lead() && is_plain(&few.fitted)?).then_some(*few))
}

/// Whether the few causes found beside corrections stay, though they leave more than noise: a search without corrections was ended before it found
/// as much, or found nothing better, or fewer causes that leave too much.
pub(crate) fn few_stay(
    setting: &Setting<'_>,
    few: &Selection,
    (selected, corrected): (&Selection, Option<&Fitted>),
    asked: Asked<'_>,
) -> Result<bool, DiagnosisError> {
    let cut_short = setting.is_over() && few.has_more_than(selected);
    let no_better = is_no_better(Reached::of(selected), Reached::of(few), few.rms_first);
    Ok(cut_short || no_better || more_are_worth_it(setting, few, (selected, corrected), asked)?)
}

/// Whether the few stay though others are fewer: beside corrections, too, these leave more by what the further causes have to cut. A search
/// without corrections may have taken one cause in place of another for what numbers within their tolerance do.
fn more_are_worth_it(
    setting: &Setting<'_>,
    few: &Selection,
    (others, corrected): (&Selection, Option<&Fitted>),
    asked: Asked<'_>,
) -> Result<bool, DiagnosisError> {
    if !(1..few.causes()).contains(&others.causes()) || few.rms >= others.rms {
        return Ok(false);
    }
    let beside = (asked.corrections, asked.able);
    let others = setting
        .campaign
        .with_reserve(|| with_corrections(setting, others.clone(), corrected.cloned(), beside))?;
    Ok(is_worth_it(Reached::of(few), Reached::of(&others), few.rms_first))
}

/// Whether the few, which are more than the others, cut what their further causes have to beside these.
fn is_worth_it(few: Reached, others: Reached, rms_first: f64) -> bool {
    let further = few.causes.saturating_sub(others.causes);
    let cut = others.rms.powi(2) - few.rms.powi(2);
    let explained = rms_first.powi(2) - others.rms.powi(2);
    others.causes > 0 && cut >= further as f64 * MISFIT * explained
}

/// Whether other causes than the few are no better: they are no fewer and leave no less, or are more for what the forms of the few may leave.
fn is_no_better(others: Reached, few: Reached, rms_first: f64) -> bool {
    let further = others.causes.saturating_sub(few.causes);
    let cut = few.rms.powi(2) - others.rms.powi(2);
    let explained = rms_first.powi(2) - few.rms.powi(2);
    let leave_no_less = few.of_the_valve <= others.of_the_valve && few.rms <= others.rms;
    few.causes > 0 && (leave_no_less || further > 0 && cut < further as f64 * MISFIT * explained)
}

/// Whether it has fewer causes and leaves as much, or no more than the noise: a transducer's scale in place of all levels, its zero in place of
/// a level and a stiffness.
fn is_simpler(one: Reached, other: Reached) -> bool {
    let as_much = other.rms + NEARLY * other.rms.max(1.0);
    (1..other.causes).contains(&one.causes) && one.rms <= as_much.max(1.0)
}

/// Whether it is the torque's scale in place of several numbers that are off by one factor, and what they leave less is what its form may leave.
fn is_their_scale(
    setting: &Setting<'_>,
    one: &Selection,
    numbers: &Selection,
    corrections: &[Correction],
) -> bool {
    one.ids().into_iter().eq([EffectId::TorqueGain])
        && is_no_better(Reached::of(numbers), Reached::of(one), one.rms_first)
        && have_one_factor(setting, numbers, corrections)
}

/// A single parameter beyond its tolerance, unless the causes of an earlier search leave less. Corrections at their bounds beside the
/// one make up for several that are off.
fn least_left(beyond: Option<Selection>, again: Option<Selection>) -> Option<Selection> {
    match (beyond, again) {
        (Some(beyond), Some(again)) if again.rms < beyond.rms - NEARLY => Some(again),
        (beyond, again) => beyond.or(again),
    }
}

/// The causes of an earlier search, if they leave no more than noise beside the corrections now: the log, or the estimate of
/// its noise, has changed since.
fn earlier_ones(
    setting: &Setting<'_>,
    earlier: &Selection,
    (given, corrected): (&Fitted, &Fitted),
) -> Result<Option<Selection>, DiagnosisError> {
    let hypothesis = &earlier.fitted.point.hypothesis;
    if hypothesis.members.is_empty() || setting.is_over() {
        return Ok(None);
    }
    let mut point = earlier.fitted.point.clone();
    point.hypothesis.corrections =
        corrected.point.hypothesis.with_corrections_of(|id| !hypothesis.has(id)).corrections;
    point.hypothesis.zero_rad = corrected.point.hypothesis.zero_rad;
    let mut state = nothing_yet(setting, given.clone());
    take_over(setting, earlier, point, &mut state)?;
    state.first_ranking.clone_from(&earlier.first_ranking);
    Ok(leaves_noise(setting, &state.fitted)?.then_some(state))
}

/// A parameter of the model that is wrong beyond its tolerance, if it leaves no more than noise beside corrections of the others. Each
/// one that the corrections alone take to its bound is tried. A search beside the corrections can't find it, because its own correction
/// is collinear with it. It must leave less than `most`, which is finite if the corrections alone leave noise.
fn beyond_tolerance(
    setting: &Setting<'_>,
    able: &[Candidate],
    (given, corrected): (&Fitted, &Fitted),
    most: f64,
) -> Result<Option<Selection>, DiagnosisError> {
    let mut found: Vec<(EffectId, Tried)> = Vec::new();
    // What counts as noise may be more than that, where it is coloured.
    let hopeless = if most.is_finite() { HOPELESS.max(most) } else { HOPELESS };
    let corrections = &corrected.point.hypothesis.corrections;
    // The torque's scale is held, and levels go to their bounds in its place.
    let scale = corrections.iter().filter(|of| of.id == EffectId::TorqueGain);
    let scale = scale.filter(|_| corrections.iter().any(Correction::is_at_bound));
    for of in corrections.iter().filter(|of| of.is_at_bound()).chain(scale) {
        let Some(candidate) = able.iter().find(|candidate| candidate.id == of.id) else { continue };
        if setting.is_over() {
            return Ok(None);
        }
        let level = Member::new(candidate, vec![of.value], candidate.free.clone());
        found.extend(if_noise_is_left(setting, corrected, level, hopeless)?.map(|tried| (of.id, tried)));
    }
    // Such parameters may stand in for a late transducer.
    let late = EffectId::SensorDelay;
    let may_be_late = !found.is_empty() && setting.campaign.kind.residual_is_torque();
    if let Some(late) = able.iter().find(|candidate| candidate.id == late).filter(|_| may_be_late) {
        found.extend(late_alone(setting, late, corrected)?.map(|tried| (late.id, tried)));
    }
    found.retain(|(_, tried)| tried.rms < most);
    if most.is_finite() {
        retain_better_in_units(setting, corrected, &mut found)?;
    }
    found.sort_by(|a, b| a.1.rms.total_cmp(&b.1.rms));
    // What looks like any of those that leave as little is tried too: in one direction a level is a torque as well, and the scale is none.
    let Some((best, least)) = found.first().map(|(best, tried)| (*best, tried.rms)) else { return Ok(None) };
    let is_alike = |(id, tried): &&(EffectId, Tried)| tried.rms <= least + more_of_alike(best, *id);
    for (id, tried) in found.clone().iter().filter(is_alike) {
        for twin in twins_in_place_of(setting, able, (*id, tried))? {
            if !found.iter().any(|(known, _)| *known == twin.0) {
                found.push(twin);
            }
        }
    }
    let alike: Vec<(EffectId, Option<Member>)> = found
        .iter()
        .skip(1)
        .filter(is_alike)
        .map(|(id, tried)| (*id, tried.fitted.point.hypothesis.members.last().cloned()))
        .collect();
    let Some((_, tried)) = found.into_iter().next() else { return Ok(None) };
    let mut state = nothing_yet(setting, given.clone());
    let round = Round {
        rms_before: state.rms,
        rivals: vec![(best, tried.rms)],
        equals: alike.iter().map(|(id, _)| *id).collect(),
        accepted: Some(best),
        rms_after: tried.rms,
        others: Vec::new(),
    };
    state.take(tried);
    if !alike.is_empty() {
        state.ambiguous.push((best, round.equals.clone()));
        state.alternatives.extend(alike.into_iter().filter_map(|(_, member)| Some((best, member?))));
    }
    state.rounds.push(round);
    Ok(Some(state))
}

/// How much more than `best`, in noise RMS, another explanation leaves at most that is alike. A scale and the level of what is most of the torque
/// differ in the other numbers alone: within their tolerance these make one into the other, and what is left is a matter of the friction's form.
fn more_of_alike(best: EffectId, other: EffectId) -> f64 {
    let is_level = |id: EffectId| id == EffectId::CoulombLevel;
    let is_scale = |id: EffectId| id == EffectId::TorqueGain;
    let differ_in_numbers = is_level(best) && is_scale(other) || is_scale(best) && is_level(other);
    if differ_in_numbers { CLEARLY_MORE } else { NEARLY }
}

/// A late transducer alone beside the corrections, in that of its forms that leaves less, if it leaves no more than noise. A torque is no straight line
/// in a delay: the first steps tell little of where the fit ends.
fn late_alone(
    setting: &Setting<'_>,
    late: &Candidate,
    corrected: &Fitted,
) -> Result<Option<Tried>, DiagnosisError> {
    least_of_forms(late, |member| {
        let Some(tried) = with_member(setting, corrected, member, STEPS)? else { return Ok(None) };
        Ok(leaves_noise(setting, &tried.fitted)?.then_some(tried))
    })
}

/// The sizes of a fit's residuals on the runs held out, in the channel's own unit.
fn sizes_held_out(setting: &Setting<'_>, fitted: &Fitted) -> Result<Vec<f64>, DiagnosisError> {
    let left = left(setting, &fitted.point)?;
    let pieces = setting.campaign.pieces.iter().zip(&left).filter(|(piece, _)| piece.hold_out);
    let samples = pieces.flat_map(|(piece, left)| left.residual.iter().zip(&piece.weights));
    Ok(samples.filter(|(_, weight)| **weight > 0.0).map(|(residual, _)| residual.abs()).collect())
}

/// Keeps what is better than the corrections, which leave noise, not only where the noise is least: it leaves no more on held-out runs in the
/// channel's own unit either, where single samples that stand far out, as a coarse encoder's do at a reversal, don't rule. No sensor is early: a lead
/// explains nothing there.
fn retain_better_in_units(
    setting: &Setting<'_>,
    corrected: &Fitted,
    found: &mut Vec<(EffectId, Tried)>,
) -> Result<(), DiagnosisError> {
    let mut sizes = sizes_held_out(setting, corrected)?;
    sizes.sort_by(f64::total_cmp);
    let far = quantile(&sizes, NOT_FAR_OUT).unwrap_or(0.0);
    let square = |sizes: &[f64]| sizes.iter().map(|size| size.min(far).powi(2)).sum::<f64>();
    let most = square(&sizes);
    let mut better = Vec::new();
    for (id, tried) in found.drain(..) {
        if !tried.fitted.point.hypothesis.has_lead()
            && square(&sizes_held_out(setting, &tried.fitted)?) <= most
        {
            better.push((id, tried));
        }
    }
    *found = better;
    Ok(())
}

/// One cause or two that leave no more than noise together with corrections of the model's parameters, if there are such.
///
/// Tried first: if parameters are off within their tolerance, a search without corrections finds causes for those errors too.
fn few_beside_corrections(
    setting: &Setting<'_>,
    able: &[Candidate],
    (given, corrected): (&Fitted, &Fitted),
    at_most: usize,
    ranked: &mut Tell<'_>,
) -> Result<Few, DiagnosisError> {
    let first = nothing_yet(setting, given.clone());
    let mut state = nothing_yet(setting, corrected.clone());
    let mut kept = None;
    // A hum that stands out once something is taken out ends the search, which would find causes for it. The search goes on once the hum is
    // taken out.
    let is_done = |state: &Selection| {
        Ok::<_, DiagnosisError>(
            leaves_noise(setting, &state.fitted)?
                || mains(setting, &left(setting, &state.fitted.point)?).is_some(),
        )
    };
    let screening = screen(setting, able, &state.fitted)?;
    state.first_ranking = screening.ranking();
    ranked(&state.first_ranking);
    // Where it is all, it is a cause like any other, and has its rivals.
    let late = with_late_transducer_alone(setting, able, &state)?;
    let mut first_screening = Some(screening);
    if let Some(late) = late
        && !is_done(&late)?
    {
        state = late;
        first_screening = None;
    }
    let mut done = false;
    for causes in 0..at_most {
        if done || setting.is_over() {
            break;
        }
        let quick = Setting { kept: kept.as_ref().or(setting.kept), ..*setting };
        let screening = match first_screening.take() {
            Some(screening) => screening,
            None => screen(&quick, able, &state.fitted)?,
        };
        // The last cause that is allowed must leave no more than noise. What promises half of the way to first order may get there.
        let best = screening.ranked.first().map_or(0.0, |best| best.gain);
        if causes + 1 == at_most && state.rms - best > HOPELESS.max(0.5 * state.rms) {
            break;
        }
        if !next_cause(&quick, &screening.ranked, &mut state)? {
            break;
        }
        refine(&quick, &mut state)?;
        tell_asymmetry_from_offset(&mut state);
        exchange(&quick, &mut state, &corrected.point.hypothesis.corrections)?;
        kept = setting.sensitivities(&state.fitted.point)?;
        if kept.is_some() {
            // Beside the cause, other corrections may be the best.
            let quick = Setting { kept: kept.as_ref(), ..*setting };
            state.take(Tried::from(&quick, state.fitted.point.clone(), CORRECTING)?);
        }
        done = is_done(&state)?;
    }
    let before = state.ids();
    simplify(setting, able, &mut state)?;
    drop_idle_transducer(setting, &mut state)?;
    if state.ids() != before {
        done = done && is_done(&state)?;
    }
    state.begin_from(&first);
    let state = Box::new(state);
    Ok(if done { Few::Found(state) } else { Few::Not(Some(state)) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What so many causes of the valve leave.
    fn reached((causes, rms): (usize, f64)) -> Reached {
        Reached { causes, of_the_valve: causes, rms }
    }

    #[test]
    fn few_causes_stay_where_others_are_no_better() {
        // Causes with and without a late transducer, and what they leave of 10 times the noise.
        let reached = |(causes, of_the_valve, rms)| Reached { causes, of_the_valve, rms };
        for (few, others, stay) in [
            ((0, 0, 2.0), (1, 1, 3.0), false),
            ((1, 1, 2.0), (1, 1, 2.0), true),
            ((1, 1, 2.0), (1, 1, 2.1), true),
            ((1, 1, 2.1), (1, 1, 2.0), false),
            ((2, 1, 2.0), (1, 1, 2.1), true),
            ((2, 2, 2.0), (1, 1, 2.1), false),
            // A further cause has to cut 0.02 of 100 − 4.
            ((1, 1, 2.0), (2, 2, 1.6), true),
            ((1, 1, 2.0), (2, 2, 1.4), false),
            ((1, 1, 2.0), (3, 3, 1.4), true),
        ] {
            assert_eq!(is_no_better(reached(others), reached(few), 10.0), stay, "{few:?} beside {others:?}");
        }
    }

    #[test]
    fn one_cause_is_simpler_than_several_that_leave_as_much() {
        for (one, others, simpler) in [
            ((1, 1.2), (2, 1.1), false),
            ((1, 1.11), (2, 1.1), true),
            ((1, 4.04), (2, 4.0), true),
            ((1, 4.05), (2, 4.0), false),
            // Below the noise nothing tells one from the other.
            ((1, 0.9), (2, 0.5), true),
            ((2, 0.5), (2, 0.5), false),
            ((0, 0.5), (2, 0.5), false),
        ] {
            assert_eq!(is_simpler(reached(one), reached(others)), simpler, "{one:?} beside {others:?}");
        }
    }

    #[test]
    fn more_causes_stay_where_they_cut_what_each_has_to() {
        for (few, others, stay) in [
            // Each further cause has to cut 0.02 of 100 − 9.
            ((2, 2.0), (1, 3.0), true),
            ((2, 2.7), (1, 3.0), false),
            ((3, 2.5), (1, 3.0), false),
            ((3, 2.2), (1, 3.0), true),
            ((1, 2.0), (0, 9.0), false),
        ] {
            assert_eq!(is_worth_it(reached(few), reached(others), 10.0), stay, "{few:?} beside {others:?}");
        }
    }
}

//! A late transducer beside what is searched for: from the start, and with a simple cause in place of an open form that stands in for both.
//!
//! A form of many numbers, presliding-hysteresis above all, bends to what a late transducer does to a simple cause: each alone leaves more
//! than it. Only together are they seen to leave no more, with fewer numbers.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::candidate::Candidate;
use crate::extend::catalogue::candidate;
use crate::extend::hypothesis::Member;
use crate::fit::equations::{Point, Setting};
use crate::name::refine::refine;
use crate::name::rivals::{Rival, as_good, numbers};
use crate::name::selection::{Round, Selection};
use crate::name::threshold::{FLOOR, rms_threshold};
use crate::name::tried::{STEPS, Tried};
use crate::name::twins::are_twins;
use valve_model::EffectId;

/// So many simple rivals, by the error that they leave alone, are tried.
const MOST: usize = 3;

/// The state with a late transducer, where one cuts the error: a search goes on from there. Every transducer is late, and what that does at
/// reversals would else be taken for a part of the causes. What looks like it is tried in its place once a cause beside it is known.
pub(crate) fn with_late_transducer_alone(
    setting: &Setting<'_>,
    able: &[Candidate],
    state: &Selection,
) -> Result<Option<Selection>, DiagnosisError> {
    let kind = setting.campaign.kind;
    let id = EffectId::SensorDelay;
    let Some(late) = able.iter().find(|of| of.id == id).filter(|_| kind.residual_is_torque()) else {
        return Ok(None);
    };
    let best = least_of_forms(late, |member| {
        let Point { hypothesis, starts } = &state.fitted.point;
        let begin = Point { hypothesis: hypothesis.with_uncorrected(member), starts: starts.clone() };
        if_possible(Tried::from(setting, begin, STEPS))
    })?;
    let Some(best) = best.filter(|best| best.rms < state.rms - FLOOR) else { return Ok(None) };
    let mut with = state.clone();
    with.take(best);
    refine(setting, &mut with)?;
    let looks_like_it = able.iter().filter(|of| are_twins(of.id, id, kind));
    let others = looks_like_it.map(|of| Member::new(of, of.neutral(), of.free.clone())).collect();
    with.rounds.push(Round {
        rms_before: state.rms,
        rivals: vec![(id, with.rms)],
        equals: Vec::new(),
        accepted: Some(id),
        rms_after: with.rms,
        others,
    });
    Ok(Some(with))
}

/// The form of a late transducer, a delay or a low-pass, that leaves least of those that `tried` fits.
pub(crate) fn least_of_forms(
    late: &Candidate,
    mut tried: impl FnMut(Member) -> Result<Option<Tried>, DiagnosisError>,
) -> Result<Option<Tried>, DiagnosisError> {
    let mut best: Option<Tried> = None;
    for probe in &late.probes {
        let Some(tried) = tried(Member::new(late, probe.shape.clone(), late.free.clone()))? else { continue };
        if best.as_ref().is_none_or(|best| tried.rms < best.rms) {
            best = Some(tried);
        }
    }
    Ok(best)
}

/// Drops the late transducer that a search began with, where the other causes leave as much without it: it stood in for them. What has taken
/// its place since has to pay like any other cause; the transducer did not have to.
pub(crate) fn drop_idle_transducer(
    setting: &Setting<'_>,
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    let begun =
        state.rounds.first().filter(|round| round.rivals.iter().all(|(id, _)| *id == EffectId::SensorDelay));
    let id = begun.and_then(|round| round.accepted).unwrap_or(EffectId::SensorDelay);
    let Point { hypothesis, starts } = &state.fitted.point;
    let place = hypothesis.members.iter().position(|of| of.candidate.id == id);
    let Some(place) = place.filter(|_| state.causes() > 1 && !setting.is_over()) else { return Ok(()) };
    let begin = Point { hypothesis: hypothesis.without(place), starts: starts.clone() };
    let Some(tried) = if_possible(Tried::from(setting, begin, STEPS))? else { return Ok(()) };
    let mut without = state.clone();
    without.take(tried);
    let least = if id == EffectId::SensorDelay {
        FLOOR * state.rms.max(1.0)
    } else {
        rms_threshold(&without, setting.loss())
    };
    if without.rms > state.rms + least {
        return Ok(());
    }
    *state = without;
    state.refuse(id, "what it does is done by the other causes as well");
    state.ambiguous.retain(|(best, _)| *best != id);
    Ok(())
}

/// The best of the simpler rivals with a late transducer beside it, if that is as good as the `chosen` one; the transducer stands before
/// the cause.
pub(crate) fn with_late_transducer(
    setting: &Setting<'_>,
    chosen: &Rival,
    rivals: &[Rival],
) -> Result<Option<Rival>, DiagnosisError> {
    let campaign = setting.campaign;
    let known = chosen.fitted.point.hypothesis.has(EffectId::SensorDelay);
    if known || !campaign.kind.residual_is_torque() {
        return Ok(None);
    }
    let Some(late) = candidate(EffectId::SensorDelay, &campaign.facts) else { return Ok(None) };
    let late = Member::new(&late, late.neutral(), late.free.clone());
    let simpler = |rival: &&Rival| numbers(rival) + late.free.len() < numbers(chosen);
    let mut found: Option<Rival> = None;
    for rival in rivals.iter().filter(simpler).filter(|of| of.id != EffectId::SensorDelay).take(MOST) {
        if setting.is_over() {
            break;
        }
        let Point { hypothesis, starts } = &rival.fitted.point;
        let mut hypothesis = hypothesis.with_uncorrected(late.clone());
        // The cause stays last: it is the round's.
        if let Some(last) = hypothesis.members.len().checked_sub(1).filter(|last| *last > 0) {
            hypothesis.members.swap(last - 1, last);
        }
        let begin = Point { hypothesis, starts: starts.clone() };
        let Some(tried) = if_possible(Tried::from(setting, begin, STEPS))? else { continue };
        let together = Rival::of(rival.id, tried);
        let least = found.as_ref().map_or(f64::INFINITY, |found| found.rms);
        if as_good(chosen, &together) && together.rms < least {
            found = Some(together);
        }
    }
    Ok(found)
}

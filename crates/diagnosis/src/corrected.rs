//! Corrections of the model's parameters within their tolerance: alone, and beside the causes that a search has selected.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::{Correction, Free, Hypothesis, Member};
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::{Fitted, fit};
use crate::fit::spread::spread;
use crate::log::piece::Piece;
use crate::measure::doubt::leaves_noise;
use crate::name::refine::fewer_orders;
use crate::name::round::LEVEL;
use crate::name::selection::Selection;
use crate::name::threshold::FLOOR;
use crate::name::tried::{EQUAL, STEPS, Tried};
use crate::show::residual::{left, rms_left};
use crate::show::whiteness::is_white;

/// Steps of a fit of the corrections within their tolerance.
pub(crate) const CORRECTING: usize = 6;
/// A correction counts as significant from this many standard errors on.
const CLEAR: f64 = 2.0;

/// The given model refitted with corrections; `None` if its residual is white without them, or none are allowed. They stay
/// neutral if they would only increase a residual that is noise already.
pub(crate) fn within_tolerance(
    setting: &Setting<'_>,
    given: &Fitted,
    corrections: &[Correction],
) -> Result<Option<Fitted>, DiagnosisError> {
    if corrections.is_empty() || is_white(setting, &left(setting, &given.point)?) {
        return Ok(None);
    }
    let hypothesis = Hypothesis { corrections: corrections.to_vec(), ..given.point.hypothesis.clone() };
    let begin = Point { hypothesis, starts: given.point.starts.clone() };
    let corrected = fit(setting, begin.clone(), &Piece::is_fitted, CORRECTING)?;
    // A loss that normalises each group by its own noise may accept a much larger error in one group for small gains in the others. That is
    // rejected where the uncorrected residual was noise already.
    let rms = |point: &Point| left(setting, point).map(|left| rms_left(setting, &left, &Piece::is_fitted));
    if rms(&corrected.point)? > rms(&given.point)? && leaves_noise(setting, given)? {
        return fit(setting, begin, &Piece::is_fitted, 0).map(Some);
    }
    Ok(Some(corrected))
}

/// Refits the selected causes together with corrections of the model's parameters, so that their intervals include
/// the tolerances. Removes a cause that only changes a parameter within its tolerance.
pub(crate) fn with_corrections(
    setting: &Setting<'_>,
    mut selection: Selection,
    corrected: Option<Fitted>,
    (corrections, able): (&[Correction], &[Candidate]),
) -> Result<Selection, DiagnosisError> {
    let Some(corrected) = corrected else { return Ok(selection) };
    let mut point = selection.fitted.point.clone();
    point.hypothesis.members.retain(|member| {
        let number = member.numbers.first().copied().unwrap_or(f64::NAN);
        // One that no fit moves would not take the cause's place.
        !corrections.iter().any(|of| of.free && of.id == member.candidate.id && of.holds(number))
    });
    selection.ambiguous.retain(|(best, _)| point.hypothesis.has(*best));
    if point.hypothesis.members.is_empty() {
        selection.take(without_idle_corrections(setting, Tried::judged(setting, corrected))?);
        return Ok(selection);
    }
    let others = corrections.iter().filter(|of| !point.hypothesis.has(of.id)).cloned();
    point.hypothesis.corrections = others.collect();
    let kept = setting.sensitivities(&point)?;
    let quick = Setting { kept: kept.as_ref(), ..*setting };
    let joint = Tried::from(&quick, point, CORRECTING)?;
    let joint = without_idle_corrections(&quick, levels_beyond(&quick, able, joint)?)?;
    let exact = if kept.is_some() { Tried::from(setting, joint.fitted.point, CORRECTING)? } else { joint };
    selection.take(exact);
    // Beside the corrections some harmonics may no longer be significant.
    for index in (0..selection.causes()).rev() {
        if selection.fitted.point.hypothesis.members.get(index).is_some_and(|member| member.candidate.series)
        {
            fewer_orders(setting, &mut selection, index)?;
        }
    }
    Ok(selection)
}

/// Makes a parameter of the model a cause if the corrections beside the causes take it to its bound and the held-out error
/// falls with it: it is off by more than its tolerance. Where the causes leave more than noise, it may only follow their misfit.
fn levels_beyond(setting: &Setting<'_>, able: &[Candidate], joint: Tried) -> Result<Tried, DiagnosisError> {
    let at_bound: Vec<Correction> =
        joint.fitted.point.hypothesis.corrections.iter().filter(|of| of.is_at_bound()).cloned().collect();
    let mut best = joint;
    let is_misfit = !at_bound.is_empty() && !leaves_noise(setting, &best.fitted)?;
    let least_cut = |rms: f64| if is_misfit { FLOOR.max(LEVEL * rms) } else { FLOOR };
    for of in at_bound.iter().filter(|of| !of.id.is_of_transducer()) {
        let Some(candidate) = able.iter().find(|candidate| candidate.id == of.id) else { continue };
        if setting.is_over() {
            break;
        }
        let member = Member::new(candidate, vec![of.value], candidate.free.clone());
        let hypothesis = best.fitted.point.hypothesis.with_uncorrected(member);
        let begin = Point { hypothesis, starts: best.fitted.point.starts.clone() };
        let tried = if_possible(Tried::from(setting, begin, STEPS))?;
        if let Some(tried) = tried.filter(|tried| tried.rms < best.rms - least_cut(best.rms)) {
            best = tried;
        }
    }
    Ok(best)
}

/// The same with corrections held at neutral if they are within their standard errors and the held-out error stays the same: a
/// parameter is corrected only if the data require it. The causes' intervals treat all corrections as uncertain nevertheless.
///
/// All of them are held at once if the error allows that, else one after the other.
pub(crate) fn without_idle_corrections(setting: &Setting<'_>, joint: Tried) -> Result<Tried, DiagnosisError> {
    let idle = idle_corrections(setting, &joint);
    if idle.is_empty() {
        return Ok(joint);
    }
    let least = joint.rms;
    if let Some(without) = holding(setting, (&joint, least), &idle)? {
        return Ok(without);
    }
    let (mut kept, mut held) = (joint, Vec::new());
    for index in idle {
        held.push(index);
        match holding(setting, (&kept, least), &held)? {
            Some(without) => kept = without,
            None => held.truncate(held.len() - 1),
        }
        if setting.is_over() {
            break;
        }
    }
    Ok(kept)
}

/// Indices of the free corrections within `CLEAR` standard errors, smallest ratio first.
fn idle_corrections(setting: &Setting<'_>, joint: &Tried) -> Vec<usize> {
    let Some(spread) = spread(&joint.fitted, setting.loss()) else { return Vec::new() };
    let hypothesis = &joint.fitted.point.hypothesis;
    let places: Vec<Free> = hypothesis.free();
    let size = |(index, of): (usize, &Correction)| {
        let place = places.iter().position(|free| *free == Free::Correction(index))?;
        let variance = spread.covariance.get((place, place)).copied().unwrap_or(f64::INFINITY);
        let errors = (of.value - of.neutral).abs() / variance.sqrt();
        (errors < CLEAR).then_some((errors, index))
    };
    let mut idle: Vec<(f64, usize)> = hypothesis.corrections.iter().enumerate().filter_map(size).collect();
    idle.sort_by(|a, b| a.0.total_cmp(&b.0));
    idle.into_iter().map(|(_, index)| index).collect()
}

/// The same fitted with these corrections held at neutral, beside those that are held anyway; `None` if the held-out error is
/// then larger than `least`.
fn holding(
    setting: &Setting<'_>,
    (tried, least): (&Tried, f64),
    held: &[usize],
) -> Result<Option<Tried>, DiagnosisError> {
    let begin = Point {
        hypothesis: tried.fitted.point.hypothesis.with_corrections_held(held),
        starts: tried.fitted.point.starts.clone(),
    };
    let Some(without) = if_possible(Tried::from(setting, begin, CORRECTING))? else { return Ok(None) };
    // If the residual is far above noise, the tolerance is relative to it.
    Ok(Some(without).filter(|without| without.rms <= least + EQUAL * least.max(1.0)))
}

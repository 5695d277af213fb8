//! Refinement after a cause is accepted: its shape parameters, and the harmonics of every accepted series.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::catalogue::look_for_orders;
use crate::extend::hypothesis::{Free, Member};
use crate::extend::stroke::{tells_apart, turns};
use crate::fit::equations::{Point, Setting, by_group};
use crate::fit::pattern::ended_poorly;
use crate::fit::spread::spread;
use crate::log::piece::Piece;
use crate::name::screen::{ORDER_FLOOR, orders_left};
use crate::name::selection::Selection;
use crate::name::tried::Tried;
use crate::numerics::gram::leave_out;
use crate::show::geared::is_over_the_angle;
use valve_model::EffectId;

/// Steps of a fit with another shape, and after how many it is given up without gain where steps are expensive.
const STEPS: usize = 6;
const FIRST_STEPS: usize = 2;
/// A shape parameter is freed if that cuts the held-out RMS by this, relative to the noise.
const REFINED: f64 = 0.003;
/// χ² with two degrees of freedom at p = 0.05: a harmonic below it is no more than its own error.
const CLEAR: f64 = 6.0;
/// The same at p = 0.05 for any of 24 orders: a series is removed if no harmonic of it exceeds this ...
const CLEAR_OF_ALL: f64 = 12.4;
/// ... and the held-out RMS rises by no more than this factor.
const HARDLY_WORSE: f64 = 1.1;

/// Frees shape parameters of the last cause that gain, adds and removes harmonics, and drops an asymmetry's part that gains nothing.
pub(crate) fn refine(setting: &Setting<'_>, state: &mut Selection) -> Result<(), DiagnosisError> {
    let Some(index) = state.causes().checked_sub(1) else { return Ok(()) };
    let Some(member) = state.fitted.point.hypothesis.members.get(index).cloned() else { return Ok(()) };
    if setting.is_over() {
        return Ok(());
    }
    for number in member.candidate.optional.iter().filter(|number| !member.free.contains(number)) {
        let mut point = state.fitted.point.clone();
        if let Some(of) = point.hypothesis.members.get_mut(index) {
            of.free.push(*number);
        }
        free_if_it_pays(setting, state, point)?;
    }
    // The harmonics of the other series were chosen without the new cause.
    for series in (0..=index).rev() {
        if state.fitted.point.hypothesis.members.get(series).is_some_and(|of| of.candidate.series) {
            more_orders(setting, state, series)?;
            fewer_orders(setting, state, series)?;
        }
    }
    let still = state.fitted.point.hypothesis.members.get(index).map(|of| of.candidate.id);
    if still == Some(EffectId::DirectionAsymmetry) {
        for number in 0..member.numbers.len() {
            let mut point = state.fitted.point.clone();
            let Some(of) = point.hypothesis.members.get_mut(index) else { continue };
            if of.free.len() < 2 {
                break;
            }
            of.free.retain(|free| *free != number);
            if let (Some(value), Some(parameter)) =
                (of.numbers.get_mut(number), member.candidate.parameters.get(number))
            {
                *value = parameter.neutral;
            }
            take_if(setting, state, point, |now, then| then < now + 0.3 * REFINED)?;
        }
    }
    Ok(())
}

/// Accepts a point with one more free number if it gains; gives up early where the residual is far above noise and steps are expensive.
fn free_if_it_pays(setting: &Setting<'_>, state: &mut Selection, point: Point) -> Result<(), DiagnosisError> {
    let begin = (point, state.fitted.progress.undamped());
    let steps = if ended_poorly(setting, &state.fitted) { FIRST_STEPS } else { STEPS };
    let Some(mut tried) = if_possible(Tried::from_progress(setting, begin, steps))? else { return Ok(()) };
    if steps < STEPS && tried.rms < state.rms {
        tried = tried.further(setting, STEPS - steps)?;
    }
    if tried.rms < state.rms - REFINED {
        state.take(tried);
    }
    Ok(())
}

/// Adds harmonics to an accepted series, one at a time, while each gains.
fn more_orders(setting: &Setting<'_>, state: &mut Selection, index: usize) -> Result<(), DiagnosisError> {
    let mut point = state.fitted.point.clone();
    let orders = orders_left(setting, &point)?;
    point
        .hypothesis
        .members
        .get_mut(index)
        .into_iter()
        .for_each(|of| look_for_orders(&mut of.candidate, &orders));
    let point = point;
    let Some(member) = point.hypothesis.members.get(index) else { return Ok(()) };
    let mut columns = setting.own_columns(&point.hypothesis)?;
    let mut taken: Vec<usize> = (0..columns.len()).collect();
    let mut places: Vec<(Vec<usize>, usize)> = Vec::new();
    for pair in member.left_out() {
        let at = columns.len();
        for number in &pair {
            columns.push(setting.own_column(&point.hypothesis, Free::Number(index, *number))?);
        }
        places.push((pair, at));
    }
    let equations = setting.equations(&point, &columns, Piece::is_fitted)?;
    let groups = by_group(setting.campaign, &point.hypothesis, &equations, columns.len());
    let loss = setting.loss();
    let weighted = loss.weighted(&groups);
    let left = |columns: &[usize]| {
        leave_out(&weighted, &groups, &setting.campaign.fold_of, columns)
            .map_or(f64::INFINITY, |held| loss.rms(held.each(&groups)))
    };
    let mut reached = left(&taken);
    let mut wider = point.clone();
    let turns = turns(&setting.campaign.facts);
    let bounded = is_over_the_angle(member.candidate.id);
    let mut held: Vec<usize> =
        member.free.iter().filter(|number| *number % 2 == 0).map(|number| number / 2 + 1).collect();
    while let Some((best, cut)) = places
        .iter()
        .filter(|(pair, _)| !bounded || tells_apart(&[&held[..], &[pair[0] / 2 + 1]].concat(), turns))
        .map(|place| (place.clone(), reached - left(&[&taken[..], &[place.1, place.1 + 1]].concat())))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|(_, cut)| *cut >= ORDER_FLOOR)
    {
        reached -= cut;
        taken.extend([best.1, best.1 + 1]);
        held.push(best.0[0] / 2 + 1);
        places.retain(|place| *place != best);
        if let Some(of) = wider.hypothesis.members.get_mut(index) {
            of.free.extend(best.0);
        }
    }
    if let Some(of) = wider.hypothesis.members.get_mut(index) {
        of.free.sort_unstable();
    }
    if wider == point {
        return Ok(());
    }
    take_if(setting, state, wider, |now, then| then < now - REFINED)
}

/// Removes harmonics that are no larger than their standard errors, if the held-out error stays the same; the series as a whole where
/// none is.
pub(crate) fn fewer_orders(
    setting: &Setting<'_>,
    state: &mut Selection,
    index: usize,
) -> Result<(), DiagnosisError> {
    let Some(spread) = spread(&state.fitted, setting.loss()) else { return Ok(()) };
    let mut fewer = state.fitted.point.clone();
    let places = fewer.hypothesis.free();
    // Squared distance from neutral over its variance; 0 for a number that is not fitted.
    let clear = |member: &Member, number: usize| {
        let place = places.iter().position(|free| *free == Free::Number(index, number));
        let variance = place.map(|place| spread.covariance[(place, place)]);
        let away = member.numbers.get(number).zip(member.candidate.parameters.get(number));
        let square = away.map_or(0.0, |(value, of)| (value - of.neutral).powi(2));
        variance.filter(|variance| *variance > 0.0).map_or(0.0, |variance| square / variance)
    };
    let Some(member) = fewer.hypothesis.members.get_mut(index) else { return Ok(()) };
    let orders = (0..member.numbers.len() / 2).map(|order| [2 * order, 2 * order + 1]);
    let fitted = orders.filter(|pair| pair.iter().any(|number| member.free.contains(number)));
    let distance = |pair: &[usize; 2]| pair.iter().map(|number| clear(member, *number)).sum::<f64>();
    let fitted: Vec<([usize; 2], f64)> = fitted.map(|pair| (pair, distance(&pair))).collect();
    if fitted.iter().all(|(_, distance)| *distance < CLEAR_OF_ALL) {
        return drop_series(setting, state, index);
    }
    let weak: Vec<[usize; 2]> =
        fitted.into_iter().filter(|(_, distance)| *distance < CLEAR).map(|(pair, _)| pair).collect();
    if weak.is_empty() {
        return Ok(());
    }
    for number in weak.into_iter().flatten() {
        member.free.retain(|free| *free != number);
        if let (Some(value), Some(of)) =
            (member.numbers.get_mut(number), member.candidate.parameters.get(number))
        {
            *value = of.neutral;
        }
    }
    // Where the residual exceeds noise, the tolerance grows with it.
    take_if(setting, state, fewer, |now, then| then < now + REFINED * now.max(1.0))
}

/// Drops a series none of whose harmonics is larger than its own errors.
fn drop_series(setting: &Setting<'_>, state: &mut Selection, index: usize) -> Result<(), DiagnosisError> {
    let hypothesis = &state.fitted.point.hypothesis;
    let Some(id) = hypothesis.members.get(index).map(|member| member.candidate.id) else { return Ok(()) };
    let begin = Point { hypothesis: hypothesis.without(index), starts: state.fitted.point.starts.clone() };
    let tried = if_possible(Tried::from(setting, begin, STEPS))?;
    // If misfit differs between runs, the standard errors say little: a series that removes much of the residual stays.
    let Some(tried) = tried.filter(|tried| tried.rms <= HARDLY_WORSE * state.rms) else { return Ok(()) };
    state.take(tried);
    state.refuse(id, "none of its harmonics is larger than its own standard error");
    state.ambiguous.retain(|(best, _)| *best != id);
    Ok(())
}

fn take_if(
    setting: &Setting<'_>,
    state: &mut Selection,
    begin: Point,
    better: impl Fn(f64, f64) -> bool,
) -> Result<(), DiagnosisError> {
    let tried = if_possible(Tried::from(setting, begin, STEPS))?;
    if let Some(tried) = tried.filter(|tried| better(state.rms, tried.rms)) {
        state.take(tried);
    }
    Ok(())
}

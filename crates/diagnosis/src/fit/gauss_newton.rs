//! Fits a hypothesis through the model: Gauss-Newton with Levenberg damping, nuisances eliminated piece by piece.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::hypothesis::Hypothesis;
use crate::fit::equations::{PieceEquations, Point, Setting, by_group, start_change};
use crate::fit::start::{best_start, better_start, square_left};
use crate::log::initial_state::InitialState;
use crate::log::piece::Piece;
use crate::log::ready::Ready;
use crate::numerics::gram::{Gram, invert};
use crate::workers::map;
use nalgebra::DVector;

/// Most steps of a fit.
const STEPS: usize = 12;
/// A fit has converged if a step reduces the loss by less than this per sample, relative to the noise variance ...
const ENOUGH: f64 = 2e-5;
/// ... or by less than this fraction of the excess over noise (a wrong model has a rough loss), or if a rejected step had
/// promised less than the second fraction of it.
const OF_THE_REST: f64 = 1e-3;
const OF_THE_REST_REFUSED: f64 = 1e-2;
/// A fit is poor if its loss exceeds the noise by this fraction: other initial states of the pieces are then tried.
pub(crate) const POOR: f64 = 0.2;
/// A successful step of a poor fit is tried at these multiples of its length.
const FARTHER: [f64; 3] = [2.0, 4.0, 8.0];
/// Damping after a rejected step: at least `LEAST_DAMPING` (which halves the step) and `MORE_DAMPING` times the last one; after a
/// successful step `LESS_DAMPING` times the last one.
const LEAST_DAMPING: f64 = 1.0;
const MORE_DAMPING: f64 = 10.0;
const LESS_DAMPING: f64 = 0.1;
/// A change is cut by a bound if less than this fraction of it is allowed; rounding takes less.
const WHOLE: f64 = 1.0 - 1e-9;
/// The fit ends at this damping.
const MOST_DAMPING: f64 = 1e3;

/// The state of a fit that can be continued.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Progress {
    damping: f64,
    /// True once each piece has its best start.
    settled: bool,
}

impl Progress {
    const NONE: Self = Self { damping: 1e-4, settled: false };

    /// Without damping, for a fit with other free numbers from the same starts.
    pub fn undamped(self) -> Self {
        Self { settled: self.settled, ..Self::NONE }
    }

    fn damp(&mut self) {
        self.damping = (self.damping * MORE_DAMPING).max(LEAST_DAMPING);
    }
}

/// A fitted hypothesis.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub point: Point,
    /// Normal equations by group; their columns are the hypothesis' free numbers.
    pub groups: Vec<Gram>,
    /// The loss over the fitted pieces.
    pub loss: f64,
    /// True if it has converged.
    pub ended: bool,
    pub progress: Progress,
}

/// Fits on the pieces that `wanted` picks.
pub(crate) fn fit(
    setting: &Setting<'_>,
    begin: Point,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
    steps: usize,
) -> Result<Fitted, DiagnosisError> {
    fit_on(setting, (begin, Progress::NONE), wanted, steps)
}

/// As [`fit`], continued from an earlier fit's point and damping.
pub(crate) fn fit_on(
    setting: &Setting<'_>,
    (begin, mut progress): (Point, Progress),
    wanted: &(impl Fn(&Piece) -> bool + Sync),
    steps: usize,
) -> Result<Fitted, DiagnosisError> {
    // Friction with a memory makes even a predicted torque jump.
    let rough = !setting.campaign.kind.smooth || setting.ready(&begin.hypothesis)?.has_sides();
    let mut here = evaluate(setting, begin, wanted)?;
    for _ in 0..steps.min(STEPS) {
        if setting.is_over() {
            break;
        }
        let total = sum(&setting.loss().weighted(&here.fitted.groups));
        let count = total.count.max(1.0);
        let rest = (here.fitted.loss - count).max(0.0);
        let Some((beta, predicted)) = step(&total, &here.fitted.point.hypothesis, progress.damping) else {
            break;
        };
        let tried = if rough && rest > POOR * count {
            far(setting, &here, &beta, progress.settled, wanted)?
        } else {
            near(setting, &here, &beta, wanted)?
        };
        let (accepted, gain, part) = match tried {
            Step::Refused => {
                progress.damp();
                if progress.damping > MOST_DAMPING {
                    break;
                }
                continue;
            }
            Step::Worse => (false, predicted, OF_THE_REST_REFUSED),
            Step::Better(there) => {
                let gain = here.fitted.loss - there.fitted.loss;
                here = *there;
                // A step of a poor fit has searched for the best starts at its end too.
                progress.settled = progress.settled && rest > POOR * count;
                progress.damping = (progress.damping * LESS_DAMPING).max(1e-7);
                (true, gain, OF_THE_REST)
            }
        };
        let little = gain < (ENOUGH * count).max(part * rest);
        here.fitted.ended = little && (progress.settled || rest < POOR * count);
        if here.fitted.ended || progress.damping > MOST_DAMPING {
            break;
        }
        if progress.settled && !accepted {
            progress.damp();
        } else if !progress.settled && (little || !accepted) {
            // The linear prediction of a step is only as good as the starts that it is taken from.
            let before = here.fitted.loss;
            let point = with_best_starts(setting, &here.fitted.point, wanted)?;
            here = evaluate(setting, point, wanted)?;
            progress.settled = true;
            here.fitted.ended = little && before - here.fitted.loss < part * rest;
            if here.fitted.ended {
                break;
            }
        }
    }
    Ok(Fitted { progress, ..here.fitted })
}

/// A fit with its pieces' equations.
struct Here {
    equations: Vec<Option<PieceEquations>>,
    fitted: Fitted,
}

/// The outcome of a step.
enum Step {
    /// The model refuses the parameter values.
    Refused,
    Worse,
    Better(Box<Here>),
}

/// A step of a good fit: it mostly succeeds, so its equations are computed at once.
fn near(
    setting: &Setting<'_>,
    here: &Here,
    beta: &DVector<f64>,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<Step, DiagnosisError> {
    let there = moved(setting, here, beta, wanted).and_then(|point| evaluate(setting, point, wanted));
    Ok(match if_possible(there)? {
        None => Step::Refused,
        Some(there) if there.fitted.loss < here.fitted.loss => Step::Better(Box::new(there)),
        Some(_) => Step::Worse,
    })
}

/// A step of a poor fit. The loss is rough there and a linear step only as long as its bumps, so a successful one is tried at
/// multiples of its length. Once the pieces have their best starts, they are searched for again at the step's end, since they
/// change the loss by more than a step does.
fn far(
    setting: &Setting<'_>,
    here: &Here,
    beta: &DVector<f64>,
    settled: bool,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<Step, DiagnosisError> {
    let trial = |times: f64| {
        let mut point = moved(setting, here, &(beta * times), wanted)?;
        if settled {
            point = with_good_starts(setting, &point, &here.fitted.point, wanted)?;
        }
        let loss = loss_of(setting, &point, wanted)?;
        Ok((point, loss))
    };
    let Some(mut best) = if_possible(trial(1.0))? else { return Ok(Step::Refused) };
    if best.1 >= here.fitted.loss {
        return Ok(Step::Worse);
    }
    for times in FARTHER {
        match if_possible(trial(times))? {
            Some(there) if there.1 < best.1 => best = there,
            _ => break,
        }
    }
    let there = if_possible(evaluate(setting, best.0, wanted))?;
    Ok(there.map_or(Step::Refused, |there| Step::Better(Box::new(there))))
}

fn evaluate(
    setting: &Setting<'_>,
    point: Point,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<Here, DiagnosisError> {
    let columns = setting.own_columns(&point.hypothesis)?;
    let equations = setting.equations(&point, &columns, wanted)?;
    let groups = by_group(setting.campaign, &point.hypothesis, &equations, columns.len());
    let loss = setting.loss().total(&groups);
    Ok(Here { equations, fitted: Fitted { point, groups, loss, ended: false, progress: Progress::NONE } })
}

pub(crate) fn sum(groups: &[Gram]) -> Gram {
    let width = groups.first().map_or(0, |group| group.matrix.nrows().saturating_sub(1));
    let mut total = Gram::zero(width);
    groups.iter().for_each(|group| total.add(group));
    total
}

/// The damped step and the gain that it promises, within the bounds of the numbers. A number that would leave its bounds is
/// held there, and the step is solved again for the others.
fn step(total: &Gram, hypothesis: &Hypothesis, damping: f64) -> Option<(DVector<f64>, f64)> {
    let free = hypothesis.free();
    let mut open: Vec<usize> = (0..free.len()).collect();
    let (all, slope) = total.part(&open);
    let mut change = DVector::zeros(free.len());
    for _ in 0..=free.len() {
        let (mut a, _) = total.part(&open);
        for i in 0..a.nrows() {
            a[(i, i)] *= 1.0 + damping;
        }
        let left = &slope - &all * &change;
        let beta = invert(a)? * DVector::from_iterator(open.len(), open.iter().map(|column| left[*column]));
        let allowed = open.iter().zip(beta.iter()).map(|(column, wanted)| {
            (
                *column,
                *wanted,
                free.get(*column).map_or(*wanted, |number| hypothesis.allowed(*number, *wanted)),
            )
        });
        // The number whose bounds allow the smallest fraction of its change is held first.
        let part = |(_, wanted, allowed): &(usize, f64, f64)| allowed / wanted;
        let held = allowed.clone().filter(|of| part(of) < WHOLE).min_by(|a, b| part(a).total_cmp(&part(b)));
        if let Some((column, _, allowed)) = held {
            change[column] = allowed;
            open.retain(|other| *other != column);
            continue;
        }
        for (column, wanted, _) in allowed {
            change[column] = wanted;
        }
        let predicted = 2.0 * change.dot(&slope) - change.dot(&(all * &change));
        return Some((change, predicted.max(0.0)));
    }
    None
}

/// The point of another hypothesis with the starts of `point`, and its loss.
pub(crate) fn loss_at(
    setting: &Setting<'_>,
    point: &Point,
    hypothesis: Hypothesis,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<(Point, f64), DiagnosisError> {
    let there = Point { hypothesis, starts: point.starts.clone() };
    let loss = loss_of(setting, &there, wanted)?;
    Ok((there, loss))
}

/// The loss without sensitivities.
fn loss_of(
    setting: &Setting<'_>,
    point: &Point,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<f64, DiagnosisError> {
    let equations = setting.equations(point, &[], wanted)?;
    let groups = by_group(setting.campaign, &point.hypothesis, &equations, 0);
    Ok(setting.loss().total(&groups))
}

/// The point after a step of `beta`; a piece keeps its old start if that has the smaller residual.
fn moved(
    setting: &Setting<'_>,
    here: &Here,
    beta: &DVector<f64>,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<Point, DiagnosisError> {
    let point = &here.fitted.point;
    let mut hypothesis = point.hypothesis.clone();
    for (free, change) in point.hypothesis.free().into_iter().zip(beta.iter()) {
        hypothesis.set(free, point.hypothesis.get(free) + change);
    }
    let zero_rad = hypothesis.zero_rad.unwrap_or(0.0);
    let starts = each_start(setting, point, &hypothesis, wanted, |index, piece, ready, start| {
        let own = here.equations.get(index).and_then(Option::as_ref);
        let bound = piece.start_bound(ready);
        let shift = start.shift + own.map_or(0.0, |own| start_change(own, beta));
        let shifted = start.shifted(shift.clamp(-bound, bound));
        better_start(setting, piece, ready, (shifted, start), zero_rad)
    })?;
    Ok(Point { starts, hypothesis })
}

/// The same hypothesis with the best start of each piece.
pub(crate) fn with_best_starts(
    setting: &Setting<'_>,
    point: &Point,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<Point, DiagnosisError> {
    let hypothesis = point.hypothesis.clone();
    let zero_rad = hypothesis.zero_rad.unwrap_or(0.0);
    let starts = each_start(setting, point, &hypothesis, wanted, |_, piece, ready, start| {
        best_start(setting, piece, ready, (piece.first_start(ready), start), zero_rad)
    })?;
    Ok(Point { starts, hypothesis })
}

/// As [`with_best_starts`], for a step from `before`, whose starts are the best ones: only pieces whose residual grew are searched.
fn with_good_starts(
    setting: &Setting<'_>,
    point: &Point,
    before: &Point,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
) -> Result<Point, DiagnosisError> {
    let hypothesis = point.hypothesis.clone();
    let zero_rad = hypothesis.zero_rad.unwrap_or(0.0);
    let zero_before_rad = before.hypothesis.zero_rad.unwrap_or(0.0);
    let ready_before = setting.ready(&before.hypothesis)?;
    let starts = each_start(setting, point, &hypothesis, wanted, |index, piece, ready, start| {
        let left_before = square_left(setting, piece, &ready_before, before.start(index), zero_before_rad);
        if square_left(setting, piece, ready, start, zero_rad) <= left_before {
            return start;
        }
        best_start(setting, piece, ready, (piece.first_start(ready), start), zero_rad)
    })?;
    Ok(Point { starts, hypothesis })
}

/// New starts for the pieces wanted.
fn each_start(
    setting: &Setting<'_>,
    point: &Point,
    hypothesis: &Hypothesis,
    wanted: &(impl Fn(&Piece) -> bool + Sync),
    new: impl Fn(usize, &Piece, &Ready, InitialState) -> InitialState + Sync,
) -> Result<Vec<InitialState>, DiagnosisError> {
    let ready = setting.ready(hypothesis)?;
    let pieces = &setting.campaign.pieces;
    let found = map(setting.workers, pieces.len(), |index| {
        let start = point.start(index);
        // The first piece of a cut run is always searched, because the others begin as it does.
        let piece =
            pieces.get(index).filter(|piece| !piece.follows() && (wanted(piece) || piece.course.is_some()));
        piece.map_or(start, |piece| new(index, piece, &ready, start))
    });
    Ok(setting.campaign.with_followers(found))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::extend::catalogue::candidate;
    use crate::extend::hypothesis::{Free, Member};
    use crate::fit::equations::Nuisances;
    use crate::fixtures;
    use crate::log::campaign::Campaign;
    use crate::workers::OneAfterTheOther;
    use log_data::{Log, Run};
    use valve_model::{Effect, EffectId, EffectValue};

    /// Swings whose torque falls with acceleration: as if the load's inertia were negative.
    fn swings() -> Log {
        let wave = std::f64::consts::TAU * 8.0;
        let run = |number: usize| {
            let time_s: Vec<f64> = (0..600).map(|k| 2.0 * number as f64 + 2e-3 * f64::from(k)).collect();
            let angle = |at_s: &f64| 0.2 * (wave * at_s).sin();
            let torque = |at_s: &f64| 1.5 * (wave * at_s).cos().signum() + 1e-3 * wave * wave * angle(at_s);
            Run {
                name: format!("{number}"),
                angle_rad: time_s.iter().map(angle).collect(),
                torque_nm: Some(time_s.iter().map(torque).collect()),
                time_s,
                ..Run::default()
            }
        };
        Log { runs: (0..3).map(run).collect(), ..Log::default() }
    }

    #[test]
    fn a_step_that_the_model_refuses_is_taken_shorter() {
        let coupling =
            Effect::new(EffectId::CouplingCompliance, &[("stiffness_nm_per_rad", EffectValue::Number(5e3))]);
        let given = fixtures::model(vec![coupling.unwrap()]);
        let campaign = Campaign::new(&swings(), &given, 0, &OneAfterTheOther).unwrap();
        let setting = Setting::new(&campaign, &given, Nuisances::default(), &OneAfterTheOther);
        let mut inertia = candidate(EffectId::LoadInertia, &campaign.facts).unwrap();
        inertia.parameters.iter_mut().for_each(|factor| factor.lower = 0.0);
        let of = |factor: f64| {
            let members = vec![Member::new(&inertia, vec![factor], vec![0])];
            Point { hypothesis: Hypothesis { members, ..Hypothesis::default() }, starts: Vec::new() }
        };
        let everything = |_: &Piece| true;
        assert!(evaluate(&setting, of(0.0), &everything).is_err(), "nothing is refused here");
        let begun = fit(&setting, of(1.0), &everything, 0).unwrap();
        let fitted = fit(&setting, of(1.0), &everything, STEPS).unwrap();
        let factor = fitted.point.hypothesis.get(Free::Number(0, 0));
        assert!((1e-9..0.9).contains(&factor), "{factor}");
        assert!(fitted.loss < begun.loss, "{} {}", fitted.loss, begun.loss);
    }

    /// Else the causes of a search that was ended are judged beside corrections that nobody has fitted.
    #[test]
    fn what_a_conclusion_needs_is_fitted_though_the_search_was_ended() {
        let given = fixtures::model(Vec::new());
        let campaign = Campaign::new(&swings(), &given, 0, &OneAfterTheOther).unwrap();
        let setting = Setting::new(&campaign, &given, Nuisances::default(), &OneAfterTheOther);
        let inertia = candidate(EffectId::LoadInertia, &campaign.facts).unwrap();
        let members = vec![Member::new(&inertia, vec![1.0], vec![0])];
        let begin = Point { hypothesis: Hypothesis { members, ..Hypothesis::default() }, starts: Vec::new() };
        let factor = |fitted: &Fitted| fitted.point.hypothesis.get(Free::Number(0, 0));
        let everything = |_: &Piece| true;
        campaign.wear_out();
        let searched = fit(&setting, begin.clone(), &everything, STEPS).unwrap();
        assert_eq!((factor(&searched), campaign.was_cut_short()), (1.0, true));
        let concluded = campaign.with_reserve(|| fit(&setting, begin, &everything, STEPS)).unwrap();
        assert!(factor(&concluded) < 0.9, "{}", factor(&concluded));
        assert!(setting.is_over(), "the search goes on");
    }
}

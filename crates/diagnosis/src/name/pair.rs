//! Pairs of causes that hide each other: more friction together with more holding torque leaves the lag unchanged, so a greedy
//! search sees neither. All pairs are screened with the linearised model, and the best is fitted.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::Member;
use crate::fit::equations::{Point, Setting};
use crate::name::refine::refine;
use crate::name::round::next_cause;
use crate::name::screen::{Place, Screening, screen};
use crate::name::selection::Selection;
use crate::name::threshold::cut_of_squares;
use crate::name::tried::{STEPS, Tried};
use crate::numerics::gram::solve;
use crate::show::residual::left;
use crate::show::whiteness::is_white;
use valve_model::EffectId;

/// How many pairs, by their fitted gain, are judged on held-out groups.
const SHORT_LIST: usize = 12;
/// A pair is fitted if its linearised gain is at least that of any pair that the greedy search could reach. It is accepted if its
/// mean square beyond noise is at most this part of the greedy result's.
const HALF: f64 = 0.5;

/// Two causes accepted together from the state `begun`; `None` unless their residual is far below the greedy search's (`found`).
pub(crate) fn hidden_pair(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    first: &Screening<'_>,
    begun: &Selection,
    found: &Selection,
) -> Result<Option<Selection>, DiagnosisError> {
    if is_white(setting, &left(setting, &found.fitted.point)?) {
        return Ok(None);
    }
    let greedy = found.rounds.first().and_then(|round| round.accepted);
    let Some(pair) = best_pair(first, greedy) else { return Ok(None) };
    let together = fit_pair(setting, begun, &pair)?.filter(|tried| leaves_less(tried.rms, found.rms));
    let Some(together) = together else { return Ok(None) };
    let state = judged(setting, candidates, begun, &together)?;
    let Some(mut state) = state.filter(|state| leaves_less(state.rms, found.rms)) else { return Ok(None) };
    let named = |of: &Selection| -> Vec<EffectId> {
        of.fitted.point.hypothesis.members.iter().map(|member| member.candidate.id).collect()
    };
    let taken = named(&state);
    let names: Vec<&str> = taken.iter().map(|id| id.name()).collect();
    let reason = format!("explains less than {} together", names.join(" and "));
    let gone = named(found).into_iter().filter(|id| !taken.contains(id));
    state.dropped.extend(gone.map(|id| (id, reason.clone())));
    Ok(Some(state))
}

/// True if `rms` has at most half of the excess over noise that `other` has; both relative to the noise.
pub(crate) fn leaves_less(rms: f64, other: f64) -> bool {
    other > 1.0 && rms.powi(2) - 1.0 <= HALF * (other.powi(2) - 1.0)
}

/// The pair with the largest linearised gain, if that exceeds every pair with the cause that the greedy search accepted. All
/// pairs are solved from the normal equations, which costs little beside the screening.
fn best_pair(first: &Screening<'_>, greedy: Option<EffectId>) -> Option<[Member; 2]> {
    let candidates = &first.candidates;
    let tally = &first.tally;
    let (square, _) = explained(first, &[])?;
    let mut pairs: Vec<(f64, &Place, &Place)> = Vec::new();
    for (index, one) in first.places.iter().enumerate() {
        let others = first.places.iter().skip(index + 1).filter(|two| two.candidate != one.candidate);
        for two in others {
            let Some((more, betas)) = explained(first, &[one, two]) else { continue };
            if numbers(candidates, [one, two], &betas).is_some() {
                pairs.push((more - square, one, two));
            }
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let is_greedy =
        |place: &Place| candidates.get(place.candidate).is_some_and(|candidate| Some(candidate.id) == greedy);
    let gain = |(_, one, two): &(f64, &Place, &Place)| {
        let columns: Vec<usize> =
            tally.own.columns.iter().chain(&one.columns).chain(&two.columns).copied().collect();
        tally.left(&columns).map_or(f64::NEG_INFINITY, |left| tally.base - left)
    };
    let (with, without): (Vec<_>, Vec<_>) =
        pairs.into_iter().partition(|(_, one, two)| is_greedy(one) || is_greedy(two));
    let alone = first.ranked.first().map_or(0.0, |best| best.gain);
    let known = with.iter().take(SHORT_LIST).map(gain).fold(alone, f64::max);
    let judged = without.iter().take(SHORT_LIST).map(|pair| (gain(pair), pair.1, pair.2));
    let (gain, one, two) = judged.max_by(|a, b| a.0.total_cmp(&b.0))?;
    if gain < known {
        return None;
    }
    let (_, betas) = explained(first, &[one, two])?;
    let [of_one, of_two] = numbers(candidates, [one, two], &betas)?;
    Some([member(candidates, one, of_one)?, member(candidates, two, of_two)?])
}

/// The weighted sum of squares that the columns of these places explain beside the accepted causes, and their coefficients.
fn explained(first: &Screening<'_>, places: &[&Place]) -> Option<(f64, Vec<f64>)> {
    let of_places = places.iter().flat_map(|place| &place.columns);
    let columns: Vec<usize> = first.tally.own.columns.iter().chain(of_places).copied().collect();
    if columns.is_empty() {
        return Some((0.0, Vec::new()));
    }
    let (beta, _) = solve(&first.tally.total, &columns)?;
    let (_, by_residual) = first.tally.total.part(&columns);
    Some((beta.dot(&by_residual), beta.iter().skip(first.tally.own.columns.len()).copied().collect()))
}

/// The parameters of both for the coefficients `betas`; `None` if they are out of bounds.
fn numbers(candidates: &[Candidate], [one, two]: [&Place; 2], betas: &[f64]) -> Option<[Vec<f64>; 2]> {
    let (of_one, of_two) = betas.split_at_checked(one.columns.len())?;
    let of = |place: &Place, betas: &[f64]| place.numbers(candidates.get(place.candidate)?, betas);
    Some([of(one, of_one)?, of(two, of_two)?])
}

/// A place's candidate with these numbers; of a series, only the place's harmonic is free.
fn member(candidates: &[Candidate], place: &Place, numbers: Vec<f64>) -> Option<Member> {
    let candidate = candidates.get(place.candidate)?;
    let free = if candidate.series {
        candidate.probes.get(place.probe)?.columns.iter().map(|(parameter, _)| *parameter).collect()
    } else {
        candidate.free.clone()
    };
    Some(Member::new(candidate, numbers, free))
}

/// Both fitted through the model, together.
fn fit_pair(
    setting: &Setting<'_>,
    begun: &Selection,
    pair: &[Member; 2],
) -> Result<Option<Tried>, DiagnosisError> {
    let mut point = begun.fitted.point.clone();
    for member in pair {
        point.hypothesis = point.hypothesis.with(member.clone());
    }
    let Some(mut tried) = if_possible(Tried::from(setting, point, STEPS))? else { return Ok(None) };
    let count = tried.fitted.point.hypothesis.members.len();
    for member in count - 2..count {
        tried = tried.searched(setting, member)?;
    }
    Ok(Some(tried))
}

/// Judges each of the two beside the other, as a round of the search would: with its rivals and its twins.
fn judged(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    begun: &Selection,
    together: &Tried,
) -> Result<Option<Selection>, DiagnosisError> {
    let count = together.fitted.point.hypothesis.members.len();
    let Some(one) = beside(setting, candidates, begun, &together.fitted.point, count - 1)? else {
        return Ok(None);
    };
    // The cause just accepted is last; now test the other one beside it.
    let Some(mut both) = beside(setting, candidates, begun, &one.fitted.point, count - 2)? else {
        return Ok(None);
    };
    both.ambiguous.extend(one.ambiguous);
    both.angles.extend(one.angles);
    both.alternatives.extend(one.alternatives);
    both.rounds.splice(0..0, one.rounds);
    Ok(Some(both))
}

/// Removes the member at `index` from `point` and runs a round; `None` unless that accepts the same effect again. Its gain is
/// measured against the others fitted alone; its rivals start beside the others as they are in the pair.
fn beside(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    begun: &Selection,
    point: &Point,
    index: usize,
) -> Result<Option<Selection>, DiagnosisError> {
    let members = &point.hypothesis.members;
    let Some(removed) = members.get(index).map(|member| member.candidate.id) else { return Ok(None) };
    let without = Point { hypothesis: point.hypothesis.without(index), starts: point.starts.clone() };
    let Tried { fitted, .. } = Tried::from(setting, without.clone(), 0)?;
    let Tried { held_out, rms, .. } = Tried::from(setting, without, STEPS)?;
    let mut state = Selection { fitted, held_out, rms, ..begun.clone() };
    if let Some(other) = state.fitted.point.hypothesis.members.last() {
        let cut = begun.rms.powi(2) - rms.powi(2);
        state.forms.add(other.candidate.id, cut, cut_of_squares(begun, &state.held_out));
    }
    let screening = screen(setting, candidates, &state.fitted)?;
    let found = next_cause(setting, &screening.ranked, &mut state)?;
    let again = state
        .rounds
        .last()
        .is_some_and(|round| round.accepted == Some(removed) || round.equals.contains(&removed));
    if !found || !again {
        return Ok(None);
    }
    refine(setting, &mut state)?;
    Ok(Some(state))
}

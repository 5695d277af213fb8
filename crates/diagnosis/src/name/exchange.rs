//! Exchange: what competed with an earlier cause is tried again in its place, once a later cause is known that hid it.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::hypothesis::{Correction, Member};
use crate::fit::equations::{Point, Setting};
use crate::name::rivals::{Rival, as_good, numbers};
use crate::name::selection::Selection;
use crate::name::threshold::FLOOR;
use crate::name::tried::{STEPS, Tried};
use valve_model::EffectId;

/// A rival whose error was at most so many times the chosen one's is tried again.
pub(crate) const COMPETED: f64 = 1.5;
/// So many of each round at most.
pub(crate) const MOST: usize = 3;
/// The error has to have fallen to this part since, or nothing was hidden.
const FALLEN: f64 = 0.9;

/// Puts rivals in the place of earlier causes where that leaves less, and into their groups where it leaves as much. `corrections` are those
/// that the search began with: a parameter of the model that gives way to a rival is corrected again.
pub(crate) fn exchange(
    setting: &Setting<'_>,
    state: &mut Selection,
    corrections: &[Correction],
) -> Result<(), DiagnosisError> {
    let members = &state.fitted.point.hypothesis.members;
    let earlier: Vec<EffectId> = members.iter().rev().skip(1).map(|member| member.candidate.id).collect();
    for id in earlier {
        let mut rivals = competitors(setting, (state, corrections), id)?;
        rivals.sort_by(|a, b| a.rms.total_cmp(&b.rms));
        match rivals.first() {
            Some(best) if best.rms < state.rms - FLOOR => take_in_place_of(state, id, best),
            _ => group_with(state, id, &rivals),
        }
    }
    Ok(())
}

/// What competed with a cause, fitted in its place now; nothing if no later cause has cut the error much.
fn competitors(
    setting: &Setting<'_>,
    (state, corrections): (&Selection, &[Correction]),
    id: EffectId,
) -> Result<Vec<Rival>, DiagnosisError> {
    let round = state.rounds.iter().rev().find(|round| round.accepted == Some(id));
    let others =
        round.filter(|round| state.rms <= FALLEN * round.rms_after).map(|round| round.others.as_slice());
    let mut rivals = Vec::new();
    for member in others.unwrap_or_default() {
        if setting.is_over() || state.fitted.point.hypothesis.has(member.candidate.id) {
            continue;
        }
        let tried =
            if_possible(in_place_of(setting, (&state.fitted.point, corrections), (id, member)))?.flatten();
        rivals.extend(tried.map(|tried| Rival::of(member.candidate.id, tried)));
    }
    Ok(rivals)
}

fn take_in_place_of(state: &mut Selection, id: EffectId, rival: &Rival) {
    state.ambiguous.retain(|(of, _)| *of != id);
    state.dropped.push((id, format!("{} does more beside the other causes", rival.id)));
    let rounds = state.rounds.iter_mut().filter(|round| round.accepted == Some(id));
    rounds.for_each(|round| round.accepted = Some(rival.id));
    state.take(rival.tried());
}

/// Adds rivals that are as good as the cause to its group.
fn group_with(state: &mut Selection, id: EffectId, rivals: &[Rival]) {
    let now = Tried { fitted: state.fitted.clone(), held_out: state.held_out.clone(), rms: state.rms };
    let own = Rival::of(id, now);
    for rival in rivals.iter().filter(|rival| as_good(&own, rival) && numbers(rival) <= numbers(&own)) {
        match state.ambiguous.iter_mut().find(|(of, _)| *of == id) {
            Some((_, others)) if others.contains(&rival.id) => continue,
            Some((_, others)) => others.push(rival.id),
            None => state.ambiguous.push((id, vec![rival.id])),
        }
        state.alternatives.extend(rival.fitted.point.hypothesis.members.last().cloned().map(|of| (id, of)));
    }
}

/// The causes at a point with another one in the place of `id`, whose own correction, if `corrections` have one, is free again.
pub(crate) fn in_place_of(
    setting: &Setting<'_>,
    (point, corrections): (&Point, &[Correction]),
    (id, member): (EffectId, &Member),
) -> Result<Option<Tried>, DiagnosisError> {
    let Point { hypothesis, starts } = point;
    let Some(place) = hypothesis.members.iter().position(|of| of.candidate.id == id) else {
        return Ok(None);
    };
    let mut hypothesis = hypothesis.without(place).with_uncorrected(member.clone());
    hypothesis.corrections.extend(corrections.iter().find(|of| of.id == id).cloned());
    let begin = Point { hypothesis, starts: starts.clone() };
    Tried::from(setting, begin, STEPS).map(Some)
}

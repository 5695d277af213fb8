//! The reasons why a candidate is not named: too little gain, too large a residual, a twin, a gear, or a larger error
//! on held-out runs.

use crate::extend::candidate::Candidate;
use crate::log::facts::Facts;
use crate::name::selection::Selection;
use crate::name::twins::missing;
use crate::outcome::{Ambiguity, Cause, Judged};
use crate::show::geared::is_over_the_angle;
use std::collections::BTreeSet;
use valve_model::EffectId;

/// Objections to selected causes.
pub(crate) struct Against {
    /// Together they leave too large a residual.
    pub doubtful: bool,
    /// Doubtful causes that there is no evidence against.
    pub spared: Vec<EffectId>,
    /// Series over the angle that stand in for a gear, each with the gear's order.
    pub geared: Vec<(EffectId, f64)>,
    /// Causes that increase the error on held-out runs.
    pub harmful: Vec<EffectId>,
    /// Causes none of whose amplitudes differs significantly from zero effect.
    pub unclear: Vec<EffectId>,
    /// Causes that laws without a name make idle.
    pub stand_ins: Vec<EffectId>,
    /// The search was ended early.
    pub ended: bool,
    /// A single doubtful cause removes the largest part nevertheless: if it can't be told from others, they are reported as a group.
    pub mostly: bool,
}

impl Against {
    /// True if a selected cause leaves too large a residual to be accepted.
    pub fn doubts(&self, id: EffectId) -> bool {
        self.doubtful && !self.spared.contains(&id)
    }

    /// True if the effect is a series over the angle, and one of those stands in for a gear.
    pub fn is_geared(&self, id: EffectId) -> bool {
        !self.geared.is_empty() && is_over_the_angle(id)
    }
}

/// The groups of causes that can't be told apart, and why.
pub(crate) fn ambiguities(selection: &Selection, against: &Against, facts: &Facts) -> Vec<Ambiguity> {
    let groups = selection.ambiguous.iter().filter(|_| !against.doubtful || against.mostly);
    let geared = |id: EffectId| against.is_geared(id);
    let open = groups.filter(|(best, others)| {
        !geared(*best) && !others.iter().any(|id| geared(*id)) && !against.unclear.contains(best)
    });
    open.map(|(best, others)| {
        let ids = std::iter::once(best).chain(others).copied().collect();
        let mut reason = why_alike(selection, *best, others, facts);
        if against.doubtful {
            reason = format!("each removes the largest part of the error, not all of it; {reason}");
        }
        Ambiguity { ids, reason, best: None, rivals: Vec::new() }
    })
    .collect()
}

/// What the data lack, and the angle between the changes of the prediction.
fn why_alike(selection: &Selection, best: EffectId, others: &[EffectId], facts: &Facts) -> String {
    let lacking: BTreeSet<&str> = others.iter().filter_map(|other| missing(best, *other, facts)).collect();
    let first = match lacking.into_iter().collect::<Vec<_>>().join(", and ") {
        none if none.is_empty() => "they fit the runs that they were not fitted on equally well".to_owned(),
        lacking => format!("in these data {lacking}"),
    };
    let angles = selection.angles.iter().filter(|(one, two, _)| *one == best && others.contains(two));
    let angles: Vec<String> = angles.map(|(_, other, angle)| format!("{angle:.1}° ({other})")).collect();
    if angles.is_empty() {
        return first;
    }
    format!(
        "{first}; the angle between what {best} and the other would change in the prediction: {}",
        angles.join(", ")
    )
}

/// Every candidate that is neither a cause nor one of a group, and why not.
pub(crate) fn rejected(
    selection: &Selection,
    able: &[Candidate],
    (causes, ambiguous): (&[Cause], &[Ambiguity]),
    against: &Against,
) -> Vec<Judged> {
    let named = |id: EffectId| {
        causes.iter().any(|cause| cause.id == id) || ambiguous.iter().any(|group| group.ids.contains(&id))
    };
    let others = able.iter().filter(|candidate| !named(candidate.id));
    others
        .map(|candidate| Judged {
            id: candidate.id,
            reason: against_selected(selection, candidate.id, against)
                .unwrap_or_else(|| why_not_selected(selection, candidate.id, against.ended)),
        })
        .collect()
}

/// The objection to a selected candidate.
fn against_selected(selection: &Selection, id: EffectId, against: &Against) -> Option<String> {
    if let Some((_, order)) = against.geared.iter().find(|(of, _)| *of == id) {
        return Some(format!(
            "follows it within the angles of this log, but by one sine of order {order:.2}, no whole number in a turn"
        ));
    }
    let selected = selection.fitted.point.hypothesis.has(id);
    if let Some((_, order)) = against.geared.first().filter(|_| selected && against.is_geared(id)) {
        return Some(format!("fits what is left of a gear's torque, {order:.2} times in a turn"));
    }
    if against.harmful.contains(&id) {
        return Some("fits, but makes the error larger on runs that nothing was chosen on".to_owned());
    }
    if against.stand_ins.contains(&id) {
        return Some(
            "stood in for a law that no cause has: beside that law, what is left is about as small without it".to_owned(),
        );
    }
    if against.unclear.contains(&id) {
        return Some(
            "fits, but each of its numbers is within its own error or the error is as small without it, so that it may as well be none"
                .to_owned(),
        );
    }
    (against.doubts(id) && selected)
        .then(|| "fits part of it, but leaves too much to be the cause".to_owned())
}

/// Why a candidate was not selected.
fn why_not_selected(selection: &Selection, id: EffectId, ended: bool) -> String {
    if let Some((_, reason)) = selection.dropped.iter().find(|(of, _)| *of == id) {
        return reason.clone();
    }
    let fits = selection.rounds.iter().flat_map(|round| {
        let best = round.rivals.first().map_or(round.rms_before, |best| best.1);
        let own = round.rivals.iter().filter(|rival| rival.0 == id);
        own.map(move |rival| (rival.1, best, round.rms_before))
    });
    if let Some((own, best, before)) = fits.min_by(|a, b| a.0.total_cmp(&b.0)) {
        return format!(
            "fitted: error on held-out runs {own:.3} times the noise, against {best:.3} for the best and {before:.3} without"
        );
    }
    let alone = |gain: f64| {
        let best = selection.first_ranking.first().map_or(0.0, |best| best.1);
        format!(
            "alone it would cut the error on held-out runs by {} at best; the best candidate: {}",
            of_noise(gain),
            of_noise(best)
        )
    };
    match selection.first_ranking.iter().find(|(of, _)| *of == id) {
        Some((_, gain)) if ended && *gain > 0.0 => {
            format!("not decided: the search was ended before it was fitted; {}", alone(*gain))
        }
        Some((_, gain)) if *gain > -0.5 => alone(*gain),
        Some(_) => "the sign or size that the data ask for is impossible".to_owned(),
        None => "shows nowhere in these data".to_owned(),
    }
}

/// A cut of the error, which is counted in noise.
fn of_noise(gain: f64) -> String {
    match gain.max(0.0) {
        little if little < 1.0 => format!("{:.1} % of the noise", 100.0 * little),
        much => format!("{much:.1} times the noise"),
    }
}

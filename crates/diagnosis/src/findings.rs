//! From a selection to the verdict, the causes with their numbers, and what to do next.
#![allow(clippy::indexing_slicing, reason = "matrices are indexed by their own sizes")]

use crate::DiagnosisError;
use crate::candidate::Candidate;
use crate::causes::{Accepted, accept};
use crate::diagnose::{Found, Judgement, Shown};
use crate::facts::Facts;
use crate::geared::order_of_a_gear;
use crate::hypothesis::Member;
use crate::loss::Loss;
use crate::measure::{Left, rms_as_fitted};
use crate::next::next_experiment;
use crate::observe::{runs_differ, speed_with_pressure};
use crate::outcome::{Ambiguity, Cause, Dependence, Description, Diagnosis, Evidence, Judged, Verdict};
use crate::piece::Piece;
use crate::ripple::phase;
use crate::select::Selection;
use crate::show::{Structure, structure};
use crate::spectrum::bands;
use crate::table::Untestable;
use crate::twins::missing;
use crate::whiteness::whiteness;
use std::collections::BTreeSet;

/// "Noise left": RMS within so many times the noise, and no covariate that explains more than this share.
const RMS_LEFT: f64 = 1.1;
const SHARE_LEFT: f64 = 0.02;
/// What chance may still do, corrected for the number of tests.
const CHANCE: f64 = 0.01;
/// A cause that explains less of what is beyond noise than this doesn't explain it; nor do several that explain less than
/// that together: they have more to bend.
const EXPLAINED: f64 = 0.5;
const EXPLAINED_TOGETHER: f64 = 0.7;
/// What the misfit of a form may leave, in parts of what the causes explain ...
pub(crate) const MISFIT: f64 = 0.02;
/// ... beyond it, one covariate that explains this part of what is left speaks of another cause.
const ANOTHER: f64 = 0.15;
/// Causes that take any function of what they depend on: alone, they leave no more than this part of what they explain.
const GENERAL: [&str; 5] =
    ["torque-offset", "torque-gain", "pressure-torque", "position-torque", "flow-torque"];
const LITTLE: f64 = 0.05;

pub(crate) fn conclude(
    judged: &Judgement<'_>,
    able: &[Candidate],
    unable: &[Untestable],
) -> Result<Found, DiagnosisError> {
    let selection = &judged.selection;
    let loss = Loss::of(&judged.setting);
    let mut undecided: Vec<&'static str> = selection.ambiguous.iter().map(|group| group.0).collect();
    let (_, left_of_all) = judged.everywhere(&selection.fitted)?;
    let structure_after = structure(&judged.setting, &left_of_all);
    let on_held_out = part_left_on_held_out(judged, &left_of_all);
    let doubtful = !selection.fitted.point.hypothesis.members.is_empty()
        && (on_held_out >= 1.0 && selection.rms_first < RMS_LEFT
            || !is_noise(&structure_after)
                && (selection.share_explained(loss) < least_share(selection)
                    || another_cause(selection, &structure_after)
                    || on_held_out > loss.hardly_less()));
    if doubtful {
        undecided =
            selection.fitted.point.hypothesis.members.iter().map(|member| member.candidate.id).collect();
    }
    let geared = geared(judged, &left_of_all);
    undecided.extend(geared.iter().map(|(id, _)| *id));
    let accepted: Vec<usize> = (0..selection.fitted.point.hypothesis.members.len())
        .filter(|index| {
            let member = selection.fitted.point.hypothesis.members.get(*index);
            member.is_some_and(|member| !undecided.contains(&member.candidate.id))
        })
        .collect();
    let Accepted { point, after, mut causes, harmful } = accept(judged, accepted)?;
    let structure_kept = structure(&judged.setting, &after);
    for cause in &mut causes {
        if let Some(text) = phase(judged.setting.campaign, cause, &after) {
            cause.evidence.insert("phase".to_owned(), Evidence::Text(text));
        }
    }
    causes.extend(judged.missed_steps(&after));
    causes.sort_by(|a, b| b.rms_gain.total_cmp(&a.rms_gain));
    let mut ambiguous =
        if doubtful { Vec::new() } else { ambiguities(selection, &judged.setting.campaign.facts) };
    ambiguous.retain(|group| !group.ids.iter().any(|id| geared.iter().any(|(of, _)| id == of)));
    let verdict = verdict(&causes, &ambiguous, &structure_kept, &structure_after);
    let mut rejected = rejected(selection, able, &causes, &ambiguous, doubtful);
    for of in rejected.iter_mut().filter(|of| harmful.contains(&of.id)) {
        of.reason = "fits, but makes the error larger on runs that nothing was chosen on".to_owned();
    }
    for (id, order) in &geared {
        for of in rejected.iter_mut().filter(|of| of.id == *id) {
            of.reason = format!(
                "follows it within the angles of this log, but by one sine of order {order:.2}, no whole number in a turn"
            );
        }
    }
    let untestable: Vec<Judged> = unable
        .iter()
        .filter(|of| !ambiguous.iter().any(|group| group.ids.iter().any(|id| id == of.id)))
        .map(|of| Judged { id: of.id.to_owned(), reason: of.reason.clone() })
        .collect();
    let mut observations = observations(judged, verdict, &after, &structure_kept);
    observations.extend(geared.iter().map(|(_, order)| {
        format!(
            "A torque goes by the angle {order:.2} times in a turn. What turns with the spool itself would go by a whole number: look for something geared to it."
        )
    }));
    let structure_left = telling(&structure_kept);
    let facts = &judged.setting.campaign.facts;
    let next_experiment = next_experiment(verdict, &ambiguous, &structure_left, &untestable, facts);
    let diagnosis = Diagnosis {
        format: "stepvalve-diagnosis".to_owned(),
        format_version: 1,
        verdict,
        residual: vec![judged.residual()],
        causes,
        ambiguous,
        rejected,
        untestable,
        gain: judged.gain_of(&after),
        next_experiment,
        structure_before: telling(&judged.structure_before),
        structure_after: structure_left,
        description_before: description(judged, &judged.before, &judged.structure_before),
        description_after: description(judged, &after, &structure_kept),
        nuisances: judged.nuisances(),
        observations,
    };
    let refused = |source| DiagnosisError::Model { run: String::new(), source };
    let extended = point.hypothesis.model(judged.setting.given).map_err(refused)?;
    Ok(found(judged, diagnosis, extended, &after))
}

fn description(judged: &Judgement<'_>, left: &[Left], structure: &Structure) -> Description {
    let noise = judged.noise_where_it_counts();
    let mut orders = structure.orders.clone();
    for order in &mut orders {
        order.both_ways *= noise;
        order.against_motion *= noise;
    }
    Description {
        rms_over_noise: structure.rms,
        whiteness: whiteness(&judged.setting, left),
        bands: bands(&judged.setting, left, noise),
        orders,
    }
}

/// What is to be said beside the causes.
fn observations(
    judged: &Judgement<'_>,
    verdict: Verdict,
    after: &[Left],
    structure: &Structure,
) -> Vec<String> {
    let campaign = judged.setting.campaign;
    let zero_nm = judged.setting.nuisances.zero_nm;
    let by_run = |as_friction: bool| {
        let of_run = |of: &&Dependence| of.on == "run" && of.as_friction == as_friction;
        let clear = |of: &Dependence| of.share > SHARE_LEFT && of.p_value < CHANCE;
        structure.dependences.iter().find(of_run).is_some_and(clear)
    };
    let open = matches!(verdict, Verdict::Unexplained | Verdict::PartlyExplained);
    let differ = open && by_run(true) && (zero_nm > 0.0 || by_run(false));
    let mut said = speed_with_pressure(campaign);
    said.extend(runs_differ(campaign, after, zero_nm).filter(|_| differ));
    said
}

/// Accepted series over the angle that are a gear's, with its order.
fn geared(judged: &Judgement<'_>, left: &[Left]) -> Vec<(&'static str, f64)> {
    let members = judged.selection.fitted.point.hypothesis.members.iter();
    let of = |member: &Member| {
        Some((member.candidate.id, order_of_a_gear(judged.setting.campaign, member, left)?))
    };
    members.filter_map(of).collect()
}

fn least_share(selection: &Selection) -> f64 {
    if selection.fitted.point.hypothesis.members.len() > 1 { EXPLAINED_TOGETHER } else { EXPLAINED }
}

/// What the causes leave of the RMS on runs that nothing was fitted or chosen on; 0 where there are none.
fn part_left_on_held_out(judged: &Judgement<'_>, left: &[Left]) -> f64 {
    let held_out = |piece: &Piece| piece.hold_out;
    let rms = |left: &[Left]| rms_as_fitted(&judged.setting, left, &held_out);
    let before = rms(&judged.before);
    if before > 0.0 { rms(left) / before } else { 0.0 }
}

/// Whether much is left, and left in order: the causes then stand in for one that the list doesn't have.
fn another_cause(selection: &Selection, structure: &Structure) -> bool {
    let left = structure.rms.powi(2) - 1.0;
    let explained = selection.explained();
    let telling = structure.dependences.iter().filter(|of| of.p_value < CHANCE);
    let share = telling.map(|of| of.share).fold(0.0, f64::max);
    let general = selection.fitted.point.hypothesis.members.iter();
    if general.map(|member| member.candidate.id).all(|id| GENERAL.contains(&id)) && left > LITTLE * explained
    {
        return true;
    }
    left > MISFIT * explained && share * structure.rms.powi(2) > ANOTHER * left
}

fn is_noise(structure: &Structure) -> bool {
    let depends = structure.dependences.iter().any(|of| of.share > SHARE_LEFT && of.p_value < CHANCE);
    structure.rms <= RMS_LEFT && !depends
}

fn telling(structure: &Structure) -> Vec<Dependence> {
    structure
        .dependences
        .iter()
        .filter(|of| of.share > 0.005 && of.p_value < CHANCE)
        .take(20)
        .cloned()
        .collect()
}

fn verdict(causes: &[Cause], ambiguous: &[Ambiguity], kept: &Structure, all: &Structure) -> Verdict {
    let noise = is_noise(if ambiguous.is_empty() { kept } else { all });
    match (causes.is_empty(), ambiguous.is_empty()) {
        (false, true) if noise => Verdict::Explained,
        (false, _) => Verdict::PartlyExplained,
        (true, false) => Verdict::Ambiguous,
        (true, true) if noise => Verdict::NoDiscrepancy,
        (true, true) => Verdict::Unexplained,
    }
}

fn ambiguities(selection: &Selection, facts: &Facts) -> Vec<Ambiguity> {
    selection
        .ambiguous
        .iter()
        .map(|(best, others)| {
            let mut ids = vec![(*best).to_owned()];
            ids.extend(others.iter().map(|id| (*id).to_owned()));
            Ambiguity { ids, reason: why_alike(selection, best, others, facts) }
        })
        .collect()
}

/// What the data lack, and the angle between what the causes change.
fn why_alike(selection: &Selection, best: &str, others: &[&'static str], facts: &Facts) -> String {
    let lacking: BTreeSet<&str> = others.iter().filter_map(|other| missing(best, other, facts)).collect();
    let first = match lacking.into_iter().collect::<Vec<_>>().join(", and ") {
        none if none.is_empty() => "they fit the runs that they were not fitted on equally well".to_owned(),
        lacking => format!("in these data {lacking}"),
    };
    let angles = selection.angles.iter().filter(|(one, two, _)| *one == best && others.contains(two));
    let angles: Vec<String> = angles.map(|(_, other, angle)| format!("{angle:.1}° ({other})")).collect();
    format!(
        "{first}; the angle between what {best} and the other would change in the prediction: {}",
        angles.join(", ")
    )
}

fn rejected(
    selection: &Selection,
    able: &[Candidate],
    causes: &[Cause],
    ambiguous: &[Ambiguity],
    doubtful: bool,
) -> Vec<Judged> {
    let mut rejected = Vec::new();
    let named = |id: &str| {
        causes.iter().any(|cause| cause.id == id)
            || ambiguous.iter().any(|group| group.ids.iter().any(|other| other == id))
    };
    for candidate in able.iter().filter(|candidate| !named(candidate.id)) {
        let fits = selection.rounds.iter().flat_map(|round| {
            let best = round.rivals.first().map_or(round.rms_before, |best| best.1);
            round
                .rivals
                .iter()
                .filter(|rival| rival.0 == candidate.id)
                .map(move |rival| (rival.1, best, round.rms_before))
        });
        let reason = if doubtful && selection.fitted.point.hypothesis.has(candidate.id) {
            "fits part of it, but leaves too much to be the cause".to_owned()
        } else if let Some((_, reason)) = selection.dropped.iter().find(|(id, _)| *id == candidate.id) {
            reason.clone()
        } else if let Some((own, best, before)) = fits.min_by(|a, b| a.0.total_cmp(&b.0)) {
            format!(
                "fitted: error on held-out runs {own:.3} times the noise, against {best:.3} for the best and {before:.3} without"
            )
        } else {
            match selection.first_ranking.iter().find(|(id, _)| *id == candidate.id) {
                Some((_, gain)) if *gain > -0.5 => format!(
                    "would cut the error on held-out runs by {:.2} % of the noise at best",
                    100.0 * gain.max(0.0)
                ),
                Some(_) => "the sign or size that the data ask for is impossible".to_owned(),
                None => "shows nowhere in these data".to_owned(),
            }
        };
        rejected.push(Judged { id: candidate.id.to_owned(), reason });
    }
    rejected
}

fn found(
    judged: &Judgement<'_>,
    diagnosis: Diagnosis,
    extended: valve_model::Model,
    after: &[Left],
) -> Found {
    let campaign = judged.setting.campaign;
    let pieces = campaign.pieces.iter().zip(&judged.before).zip(after);
    let shown = pieces.map(|((piece, before), after)| shown(judged, piece, before, after)).collect();
    let rounds = judged
        .selection
        .rounds
        .iter()
        .map(|round| (round.accepted, round.rms_before, round.rivals.clone()))
        .collect();
    Found {
        diagnosis,
        extended,
        channel: campaign.channel,
        rounds,
        ranking: judged.selection.first_ranking.clone(),
        shown,
        samples: (campaign.samples, campaign.pieces.iter().map(Piece::len).sum()),
    }
}

fn shown(judged: &Judgement<'_>, piece: &Piece, before: &Left, after: &Left) -> Shown {
    let (name, kind) = judged.setting.campaign.runs.get(piece.run).cloned().unwrap_or_default();
    Shown {
        run: piece.run,
        name,
        kind,
        held_out: piece.hold_out,
        time_s: piece.driven.time_s().to_vec(),
        angle_rad: (0..piece.len()).map(|index| piece.kinematics(index).0).collect(),
        speed_rad_per_s: (0..piece.len()).map(|index| piece.kinematics(index).1).collect(),
        pressure_pa: piece.driven.pressure_pa().to_vec(),
        temperature_c: piece.driven.temperature_c().to_vec(),
        measured: piece.measured.clone(),
        before: before.predicted.clone(),
        after: after.predicted.clone(),
    }
}

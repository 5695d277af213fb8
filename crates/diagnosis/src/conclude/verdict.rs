//! From the selected causes to the verdict, the accepted causes with their numbers, and the next experiment.

use crate::DiagnosisError;
use crate::conclude::next_experiment::next_experiment;
use crate::conclude::reasons::{Against, ambiguities, rejected};
use crate::extend::candidate::Candidate;
use crate::extend::catalogue::Untestable;
use crate::extend::hypothesis::Member;
use crate::found::{Found, Shown};
use crate::log::piece::Piece;
use crate::measure::accept::{Accepted, accept, best_of_groups};
use crate::measure::judgement::Judgement;
use crate::name::forms::MISFIT;
use crate::name::selection::Selection;
use crate::numerics::statistics::{CHANCE, SHARE_LEFT};
use crate::outcome::{
    Ambiguity, BestOfGroup, Cause, Dependence, Description, Diagnosis, Evidence, Judged, Nearest, Verdict,
};
use crate::show::geared::order_of_a_gear;
use crate::show::observe::{runs_differ, speed_with_pressure};
use crate::show::residual::{Left, rms_as_fitted};
use crate::show::ripple::phase;
use crate::show::spectrum::spectrum;
use crate::show::structure::{Structure, structure};
use crate::show::tone::{Tone, tone};
use crate::show::whiteness::{is_rounding, whiteness};
use log_data::Channel;
use valve_model::{Condition, Effect, EffectId};

/// The residual counts as noise up to this RMS, in parts of the noise, if no covariate explains more than `SHARE_LEFT` of it.
const RMS_LEFT: f64 = 1.1;
const DEVIATIONS: f64 = 3.0;
/// The share of the residual beyond noise that one cause, or several together, must explain to be accepted. Several
/// have more free numbers, so more is asked of them.
const EXPLAINED: f64 = 0.5;
const EXPLAINED_TOGETHER: f64 = 0.7;
/// If the residual exceeds the misfit of the causes' forms, one covariate that explains this share of it points to a
/// further cause.
const ANOTHER: f64 = 0.15;
/// Causes whose form is general: they take any function of what they depend on. Alone, their residual is at most
/// `LITTLE` of what they explain.
const GENERAL: [EffectId; 5] = [
    EffectId::TorqueOffset,
    EffectId::TorqueGain,
    EffectId::PressureTorque,
    EffectId::PositionTorque,
    EffectId::FlowTorque,
];
const LITTLE: f64 = 0.05;

pub(crate) fn conclude(
    judged: &Judgement<'_>,
    able: &[Candidate],
    unable: &[Untestable],
) -> Result<Found, DiagnosisError> {
    let selection = &judged.selection;
    let facts = &judged.setting.campaign.facts;
    let (point_of_all, left_of_all) = judged.everywhere(&selection.fitted)?;
    let structure_of_all = structure(&judged.setting, &left_of_all);
    let tone = tone(&judged.setting, &left_of_all);
    let mut against = Against {
        doubtful: is_doubtful(judged, &left_of_all, &structure_of_all),
        geared: geared(judged, &left_of_all),
        harmful: Vec::new(),
    };
    let nearest = against.doubtful.then(|| nearest(judged, &structure_of_all)).flatten();
    let with_all = judged.gain_of(&left_of_all).rms_after;
    let Accepted { point, after, mut causes, corrected, covariance, harmful } =
        accept(judged, undisputed(selection, &against), (point_of_all, left_of_all))?;
    against.harmful = harmful;
    let structure_kept = structure(&judged.setting, &after);
    for cause in &mut causes {
        if let Some(text) = phase(judged.setting.campaign, cause, &after) {
            cause.evidence.insert("phase".to_owned(), Evidence::Text(text));
        }
    }
    causes.extend(judged.missed_steps(&after));
    causes.sort_by(|a, b| b.rms_gain.total_cmp(&a.rms_gain));
    let mut ambiguous = ambiguities(selection, &against, facts);
    let proposed = propose(judged, &causes, &against, with_all, &mut ambiguous)?;
    let verdict = verdict(
        &causes,
        &ambiguous,
        is_rounding(&judged.setting, &after) || is_noise(&structure_kept) && tone.is_none(),
    );
    let rejected = rejected(selection, able, (&causes, &ambiguous), &against);
    let untestable: Vec<Judged> = unable
        .iter()
        .filter(|of| !ambiguous.iter().any(|group| group.ids.contains(&of.id)))
        .map(|of| Judged { id: of.id, reason: of.reason.clone() })
        .collect();
    let mut observations = observations(judged, verdict, &after, &structure_kept);
    let is_rounding = is_rounding(&judged.setting, &after);
    observations.extend(tone.filter(|_| !is_rounding).map(|tone| hum(judged, tone)));
    observations.extend(against.geared.iter().map(|(_, order)| {
        format!(
            "A torque goes by the angle {order:.2} times in a turn. What turns with the spool itself would go by a whole number: look for something geared to it."
        )
    }));
    let structure_left = telling(&structure_kept);
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
        within_tolerance: corrected,
        covariance,
        nearest,
        nuisances: judged.nuisances(),
        observations,
    };
    let refused = |source| judged.setting.campaign.refused(source);
    let told = |id: EffectId| diagnosis.within_tolerance.iter().any(|of| of.id == id);
    let extended = point.hypothesis.extending(told).model(judged.setting.given).map_err(refused)?;
    Ok(Found { proposed, ..found(judged, diagnosis, extended, &after) })
}

/// Puts into each group the effect that fitted best, and returns these effects. Only if no cause is accepted, nothing
/// is objected to the selection, and with all of these the held-out RMS falls to `rms_after`.
fn propose(
    judged: &Judgement<'_>,
    causes: &[Cause],
    against: &Against,
    rms_after: f64,
    ambiguous: &mut [Ambiguity],
) -> Result<Vec<Effect>, DiagnosisError> {
    let undisputed = !against.doubtful && against.geared.is_empty() && against.harmful.is_empty();
    let alone = causes.is_empty() && !ambiguous.is_empty();
    if !alone || !undisputed || rms_after >= judged.gain_of(&judged.before).rms_before {
        return Ok(Vec::new());
    }
    let mut effects = Vec::new();
    for (effect, parameters) in best_of_groups(judged)? {
        let id = effect.id().to_owned();
        let Some(group) = ambiguous.iter_mut().find(|group| group.ids.contains(&id)) else { continue };
        group.best = Some(BestOfGroup { id, parameters, rms_after });
        effects.push(effect);
    }
    Ok(effects)
}

/// True if the selected causes leave too large a residual to be the cause.
fn is_doubtful(judged: &Judgement<'_>, left: &[Left], structure: &Structure) -> bool {
    let selection = &judged.selection;
    if selection.fitted.point.hypothesis.members.is_empty() {
        return false;
    }
    let loss = judged.setting.loss();
    let on_held_out = part_left_on_held_out(judged, left);
    let no_better = on_held_out >= 1.0 && selection.rms_first < RMS_LEFT;
    let too_little = || {
        selection.share_explained(loss) < least_share(selection)
            || another_cause(selection, structure)
            || on_held_out > loss.hardly_less()
    };
    no_better || !is_noise(structure) && too_little()
}

/// Indices of the members to which nothing is objected and that are in no group of twins.
fn undisputed(selection: &Selection, against: &Against) -> Vec<usize> {
    let disputed = |id: EffectId| {
        against.doubtful || selection.ambiguous.iter().any(|(of, _)| *of == id) || against.is_geared(id)
    };
    let members = selection.fitted.point.hypothesis.members.iter().enumerate();
    members.filter(|(_, member)| !disputed(member.candidate.id)).map(|(index, _)| index).collect()
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
        bands: spectrum(&judged.setting, left).bands(noise),
        orders,
    }
}

/// Observations that are no cause.
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

/// Selected series over the angle that stand in for a gear, each with the gear's order.
fn geared(judged: &Judgement<'_>, left: &[Left]) -> Vec<(EffectId, f64)> {
    let members = judged.selection.fitted.point.hypothesis.members.iter();
    let of = |member: &Member| {
        Some((member.candidate.id, order_of_a_gear(judged.setting.campaign, member, left)?))
    };
    members.filter_map(of).collect()
}

/// The sentence on a tone. The tone may be as loud at rest, where it counts as noise of the measurement.
fn hum(judged: &Judgement<'_>, tone: Tone) -> String {
    let amplitude = tone.amplitude * judged.noise_where_it_counts();
    let amplitude = match judged.setting.campaign.kind.channel {
        Channel::Torque => format!("{amplitude:.3} N·m"),
        _ => format!("{amplitude:.1e} rad"),
    };
    format!(
        "What is left is mostly a tone of {:.1} Hz, amplitude {amplitude}: {:.0} % of it. No cause of the list hums: look for mains, a pump, or a structure that rings.",
        tone.hz,
        100.0 * tone.share
    )
}

fn least_share(selection: &Selection) -> f64 {
    if selection.fitted.point.hypothesis.members.len() > 1 { EXPLAINED_TOGETHER } else { EXPLAINED }
}

/// The ratio of the held-out RMS with the causes to that without; 0 without held-out runs.
fn part_left_on_held_out(judged: &Judgement<'_>, left: &[Left]) -> f64 {
    let held_out = |piece: &Piece| piece.hold_out;
    let rms = |left: &[Left]| rms_as_fitted(&judged.setting, left, &held_out);
    let before = rms(&judged.before);
    if before > 0.0 { rms(left) / before } else { 0.0 }
}

/// True if the residual is large and structured: the causes then stand in for one that is not on the list.
fn another_cause(selection: &Selection, structure: &Structure) -> bool {
    let left = structure.rms.powi(2) - 1.0;
    let explained = selection.explained();
    let ids: Vec<EffectId> =
        selection.fitted.point.hypothesis.members.iter().map(|member| member.candidate.id).collect();
    let own = |of: &&Dependence| of.p_value < CHANCE && !is_of_another(&ids, &of.on);
    let share = structure.dependences.iter().filter(own).map(|of| of.share).fold(0.0, f64::max);
    let others = structure.dependences.iter().filter(|of| of.p_value < CHANCE && is_of_another(&ids, &of.on));
    let of_others = others.map(|of| of.share).fold(0.0, f64::max);
    let general = ids.iter().all(|id| GENERAL.contains(id)) && of_others < share.max(ANOTHER);
    if general && left > LITTLE * explained {
        return true;
    }
    left > MISFIT * explained && share * structure.rms.powi(2) > ANOTHER * left
}

/// True if none of the selected causes depends on this covariate, so that a residual that does points to a further
/// cause. Any cause may depend on speed, acceleration or run.
fn is_of_another(ids: &[EffectId], on: &str) -> bool {
    let over_the_angle = |id: &EffectId| {
        matches!(
            id,
            EffectId::AngleDependentFriction
                | EffectId::PositionTorque
                | EffectId::FlowTorque
                | EffectId::DetentTorque
                | EffectId::MicrostepError
                | EffectId::EncoderEccentricity
        )
    };
    if on.starts_with("angle") {
        return !ids.iter().any(over_the_angle);
    }
    let needs = |condition: Condition| ids.iter().any(|id| id.spec().needs == Some(condition));
    match on {
        "pressure" => !needs(Condition::PressureDrop),
        "temperature" => !needs(Condition::OilTemperature),
        _ => false,
    }
}

/// What was selected and not accepted, where it removes more than half of what is beyond noise.
fn nearest(judged: &Judgement<'_>, structure: &Structure) -> Option<Nearest> {
    let selection = &judged.selection;
    let removes = selection.share_explained(judged.setting.loss());
    let members = selection.fitted.point.hypothesis.members.iter();
    let ids: Vec<EffectId> = members.map(|member| member.candidate.id).collect();
    let leaves_by = structure.dependences.iter().find(|of| of.p_value < CHANCE && of.share > SHARE_LEFT);
    (removes > EXPLAINED).then(|| Nearest { ids, removes, leaves_by: leaves_by.map(|of| of.on.clone()) })
}

/// Whether a residual is no more than noise.
pub(crate) fn is_noise(structure: &Structure) -> bool {
    // Below the noise, shares count in parts of the noise's variance, so a large share of a small residual is not
    // significant.
    let square = structure.rms.powi(2).min(1.0);
    let depends =
        structure.dependences.iter().any(|of| of.share * square > SHARE_LEFT && of.p_value < CHANCE);
    // An RMS of few samples is itself uncertain.
    structure.rms <= RMS_LEFT + DEVIATIONS / (2.0 * structure.count).sqrt() && !depends
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

fn verdict(causes: &[Cause], ambiguous: &[Ambiguity], noise: bool) -> Verdict {
    match (causes.is_empty(), ambiguous.is_empty()) {
        (false, true) if noise => Verdict::Explained,
        (false, _) => Verdict::PartlyExplained,
        (true, false) => Verdict::Ambiguous,
        (true, true) if noise => Verdict::NoDiscrepancy,
        (true, true) => Verdict::Unexplained,
    }
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
    Found {
        diagnosis,
        extended,
        channel: campaign.kind.channel,
        ranking: judged.selection.first_ranking.clone(),
        shown,
        proposed: Vec::new(),
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

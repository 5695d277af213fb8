//! From the selected causes to the verdict, the accepted causes with their numbers, and the next experiment.

use crate::DiagnosisError;
use crate::conclude::leads::offer_leads;
use crate::conclude::negligible::negligible;
use crate::conclude::next_experiment::{Left, next_experiment};
use crate::conclude::reasons::{Against, ambiguities, rejected};
use crate::conclude::ripples::{
    drifting, kept_out, offer, ripples, ripples_in_words, ripples_left, tell_phases,
};
use crate::contest::Contest;
use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::Member;
use crate::extend::untestable::Untestable;
use crate::found::{Event, Found, Shown};
use crate::log::campaign::Campaign;
use crate::log::piece::Piece;
use crate::measure::accept::{Accepted, accept, best_of_groups, members_with_numbers, vague_groups};
use crate::measure::alternatives::rivals;
use crate::measure::doubt::{is_doubtful, is_noise, spared};
use crate::measure::judgement::Judgement;
use crate::name::selection::Selection;
use crate::numerics::statistics::CHANCE;
use crate::outcome::{
    Ambiguity, BestOfGroup, Cause, Corrected, Covariance, Dependence, Description, Diagnosis, Gain, Judged,
    Nearest, Offered, Unnamed, Verdict,
};
use crate::show::geared::order_of_a_gear;
use crate::show::observe::{runs_differ, speed_with_pressure, torque};
use crate::show::repeated::is_repeated;
use crate::show::residual::PieceResidual;
use crate::show::spectrum::spectrum;
use crate::show::structure::{Structure, counts, depends, orders, structure};
use crate::show::tone::{Tone, tone as show_tone};
use crate::show::whiteness::{is_rounding, whiteness};
use crate::unnamed::{Extended, unnamed};
use log_data::Channel;
use valve_model::{Effect, EffectId, Model};

/// Advice after a search that was ended early.
const AGAIN: &str = "The search was ended before it came to its end. Say what is known, so that less has to be searched: numbers of the \
                     model (--fix), the noise (--noise), a law that you suspect (--hypothesis); or leave out runs that are like others (--exclude).";
/// What is left where noise would not do so.
const REPEATED: &str = "What is left takes the same course in every run over the time since its beginning: look for what begins anew with each run.";
/// Causes that are not accepted are reported as nearest if they remove more than this share of the excess over noise.
const MOST_OF_IT: f64 = 0.5;

/// The diagnosis.
pub(crate) fn conclude(
    judged: &Judgement<'_>,
    able: &[Candidate],
    unable: &[Untestable],
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Found, DiagnosisError> {
    let is_over = judged.setting.is_over();
    judged.setting.campaign.with_reserve(|| conclusion(judged, (able, unable), is_over, tell))
}

fn conclusion(
    judged: &Judgement<'_>,
    (able, unable): (&[Candidate], &[Untestable]),
    is_over: bool,
    tell: &mut dyn FnMut(Event<'_>),
) -> Result<Found, DiagnosisError> {
    let selection = &judged.selection;
    let facts = &judged.setting.campaign.facts;
    let ended = is_over || judged.setting.campaign.was_cut_short();
    let (point_of_all, left_of_all) = judged.everywhere(&selection.fitted)?;
    let structure_of_all = structure(&judged.setting, &left_of_all);
    let tone = show_tone(&judged.setting, &left_of_all);
    let all_leave_noise = leaves_noise_alone(judged, (&left_of_all, &structure_of_all), tone.as_ref());
    let mut against = Against {
        doubtful: is_doubtful(judged, &left_of_all, &structure_of_all, is_over),
        spared: Vec::new(),
        geared: geared(judged, &left_of_all, is_noise(&structure_of_all)),
        harmful: Vec::new(),
        unclear: Vec::new(),
        stand_ins: Vec::new(),
        ended,
        mostly: false,
    };
    if against.doubtful {
        let places = spared(judged, &structure_of_all)?;
        let members = &selection.fitted.point.hypothesis.members;
        against.spared = places.iter().filter_map(|at| Some(members.get(*at)?.candidate.id)).collect();
    }
    let nearest = if against.doubtful { nearest(judged, &structure_of_all)? } else { None };
    let with_all = judged.gain_of(&left_of_all).rms_after;
    let mut kept = undisputed(selection, &against);
    let ripples = ripples(judged, &left_of_all, structure_of_all.per_independent);
    let drifting: Vec<usize> = drifting(&ripples).filter(|index| kept.contains(index)).collect();
    let leading: Vec<usize> =
        selection.fitted.point.hypothesis.leads().filter(|index| kept.contains(index)).collect();
    kept.retain(|index| !drifting.contains(index) && !leading.contains(index));
    let vague = vague_groups(judged, &left_of_all)?;
    let accepted = accept(judged, kept, (point_of_all, left_of_all))?;
    let Accepted { point, after, mut causes, corrected, covariance, harmful, unclear } =
        without_what_only_harms(judged, accepted)?;
    (against.harmful, against.unclear) = (harmful, unclear);
    against.unclear.extend(vague);
    let structure_kept = structure(&judged.setting, &after);
    tell_phases(judged, &ripples, &mut causes);
    let mut offered = offer(judged, &ripples, &drifting, with_all)?;
    offered.extend(offer_leads(judged, &leading, with_all)?);
    causes.extend(judged.missed_steps(&after));
    causes.sort_by(|a, b| b.rms_gain.total_cmp(&a.rms_gain));
    against.mostly = nearest.as_ref().is_some_and(|of| of.ids.len() == 1);
    // If some doubtful causes are named, none is reported as nearest.
    let nearest = nearest.filter(|_| against.spared.is_empty());
    let mut ambiguous = ambiguities(selection, &against, facts);
    let noise = leaves_noise_alone(judged, (&after, &structure_kept), tone.as_ref());
    // No sensor is early: where nothing needs an explanation, a lead is none, nor is what can't be told from it.
    let grouped = groups_of_leads(selection, &mut ambiguous, noise);
    offered.extend(offer_leads(judged, &grouped, with_all)?);
    let laws = if noise || !ambiguous.is_empty() && all_leave_noise {
        None
    } else {
        tell(Event::Step("looking for a law in what no cause explains"));
        let of_group = |ids: &[EffectId]| -> Vec<&Member> {
            let own = selection.fitted.point.hypothesis.members.iter();
            let leader = own.filter(|member| ids.first() == Some(&member.candidate.id));
            let others = selection.alternatives.iter().filter(|(best, _)| ids.first() == Some(best));
            leader.chain(others.map(|(_, member)| member)).collect()
        };
        let groups: Vec<Vec<&Member>> = ambiguous.iter().map(|group| of_group(&group.ids)).collect();
        unnamed(judged, able, (&point, &after, &causes), &groups)?
    };
    // Time that ran out in a search for laws ended that.
    let ended = ended || !noise && judged.setting.workers.is_over();
    let may_be_little = !noise && laws.is_none() && is_plain(judged, tone.as_ref());
    let little = if may_be_little { negligible(judged, &structure_kept) } else { None };
    let noise = noise || little.is_some();
    if let Some(laws) = &laws {
        (causes, against.stand_ins) = laws.beside(causes);
        against.stand_ins.extend(ambiguous.drain(..).flat_map(|group| group.ids));
    }
    let mut proposed = propose(judged, &causes, &against, with_all, &mut ambiguous)?;
    let (rivals, mut contests) = with_rivals(judged, &mut ambiguous)?;
    let verdict = verdict(&causes, &ambiguous, noise);
    let mut nuisances = judged.nuisances()?;
    let Concluded { model, gain, after, corrected, covariance, structure: structure_kept, tone, told } =
        match laws {
            None => {
                let refused = |source| judged.setting.campaign.refused(source);
                let model = point.hypothesis.model(judged.setting.given).map_err(refused)?;
                let (gain, structure) = (judged.gain_of(&after), structure_kept);
                Concluded { model, gain, after, corrected, covariance, structure, tone, told: Vec::new() }
            }
            Some(mut laws) => {
                nuisances.extend(laws.nuisances(&causes, judged.setting.given));
                contests.extend(laws.contest.take());
                with_laws(judged, laws)?
            }
        };
    let mut rejected = rejected(selection, able, (&causes, &ambiguous), &against);
    rejected.retain(|of| !offered.iter().any(|(effect, _)| effect.id() == of.id));
    // A lead that the laws were fitted beside is in the model with them.
    offered.retain(|(offered, _)| !model.effects.iter().any(|of| of.id() == offered.id()));
    proposed.extend(offered.iter().map(|(effect, _)| effect.clone()));
    let offered: Vec<Offered> = offered.into_iter().map(|(_, offered)| offered).collect();
    let untestable: Vec<Judged> = unable
        .iter()
        .filter(|of| !ambiguous.iter().any(|group| group.ids.contains(&of.id)))
        .map(|of| Judged { id: of.id, reason: of.reason.clone() })
        .collect();
    let mut observations = observations(judged, verdict, &after, &structure_kept)?;
    // What is explained needs no further search.
    let ended_open = ended && !matches!(verdict, Verdict::NoDiscrepancy | Verdict::Explained);
    observations.extend(ended_open.then(|| cut_short(judged.setting.campaign)));
    observations.extend(little);
    let ripples = ripples_left(judged, verdict, &after);
    observations.extend(ripples_in_words(&ripples, judged.setting.campaign.kind.channel.unit()));
    observations.extend(offered.iter().map(|of| kept_out(of, judged.setting.campaign.kind.channel.unit())));
    let is_rounding = is_rounding(&judged.setting, &after);
    observations.extend(tone.filter(|_| !is_rounding).map(|tone| hum(judged, tone)));
    observations.extend(against.geared.iter().map(|(_, order)| {
        format!(
            "A torque goes by the angle {order:.2} times in a turn. What turns with the spool itself would go by a whole number: look for something geared to it."
        )
    }));
    let structure_left = telling(&structure_kept);
    let next_experiment = if ended_open {
        AGAIN.to_owned()
    } else {
        let left = Left { by: &structure_left, beside_laws: !told.is_empty() };
        next_experiment(verdict, &ambiguous, &left, &untestable, facts)
    };
    let diagnosis = Diagnosis {
        format: "stepvalve-diagnosis".to_owned(),
        format_version: 1,
        verdict,
        residual: vec![judged.residual(&after)],
        causes,
        ambiguous,
        rejected,
        untestable,
        gain,
        unnamed: told,
        next_experiment,
        search_ended: ended_open,
        structure_before: telling(&judged.structure_before),
        structure_after: structure_left,
        description_before: description(judged, &judged.before, &judged.structure_before),
        description_after: description(judged, &after, &structure_kept),
        within_tolerance: corrected,
        covariance,
        nearest,
        nuisances,
        offered,
        ripples,
        observations,
    };
    Ok(Found { proposed, rivals, contests, ..found(judged, diagnosis, model, &after) })
}

/// The extended model, and what follows from it: with the accepted causes, and with laws without a name where there are any.
struct Concluded {
    model: Model,
    gain: Gain,
    after: Vec<PieceResidual>,
    corrected: Vec<Corrected>,
    covariance: Covariance,
    structure: Structure,
    tone: Option<Tone>,
    told: Vec<Unnamed>,
}

fn with_laws(judged: &Judgement<'_>, laws: Extended) -> Result<Concluded, DiagnosisError> {
    let model = laws.model(judged)?;
    let gain = Gain { unnamed: Some(laws.gain), ..judged.gain_of(&laws.after) };
    let structure = structure(&judged.setting, &laws.after);
    let tone = show_tone(&judged.setting, &laws.after);
    let Extended { after, corrected, covariance, told, .. } = laws;
    Ok(Concluded { model, gain, after, corrected, covariance, structure, tone, told })
}

/// Whether what is left needs no explanation.
fn leaves_noise_alone(
    judged: &Judgement<'_>,
    (after, structure): (&[PieceResidual], &Structure),
    tone: Option<&Tone>,
) -> bool {
    is_rounding(&judged.setting, after) || is_plain(judged, tone) && is_noise(structure)
}

/// Whether nothing is in a residual that its size and its dependences don't tell: a misfit that counts as noise, a tone, or ripples of each run.
fn is_plain(judged: &Judgement<'_>, tone: Option<&Tone>) -> bool {
    judged.noise.share == 1.0 && tone.is_none() && judged.setting.campaign.loose_ripples.is_empty()
}

/// Drops all accepted causes if they don't reduce the error on held-out runs: they were fitted beside a group that isn't accepted.
/// Samples are weighted as in the fit, because a plain RMS is dominated by those that an encoder's steps make least certain.
fn without_what_only_harms(judged: &Judgement<'_>, accepted: Accepted) -> Result<Accepted, DiagnosisError> {
    let gain = judged.gain_of(&accepted.after);
    if accepted.causes.is_empty() || gain.over_noise_after < gain.over_noise_before {
        return Ok(accepted);
    }
    let ids = accepted.causes.iter().map(|cause| cause.id);
    let harmful: Vec<EffectId> = accepted.harmful.iter().copied().chain(ids).collect();
    let none = accept(judged, Vec::new(), judged.everywhere(&judged.selection.fitted)?)?;
    Ok(Accepted { harmful, ..none })
}

/// Puts into each group the effect that fitted best, and returns these effects. Only if no cause is accepted, there is no
/// objection to the selection, and the held-out RMS falls (to `rms_after`) with all of these.
fn propose(
    judged: &Judgement<'_>,
    causes: &[Cause],
    against: &Against,
    rms_after: f64,
    ambiguous: &mut [Ambiguity],
) -> Result<Vec<Effect>, DiagnosisError> {
    let undisputed = !against.doubtful && against.geared.is_empty();
    let undisputed = undisputed && against.harmful.is_empty() && against.unclear.is_empty();
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

/// Puts the fitted rivals into each group, and returns their effects, and the contest of each group.
fn with_rivals(
    judged: &Judgement<'_>,
    ambiguous: &mut [Ambiguity],
) -> Result<(Vec<Effect>, Vec<Contest>), DiagnosisError> {
    let (mut effects, mut contests) = (Vec::new(), Vec::new());
    for group in ambiguous {
        let Some(best) = group.ids.first() else { continue };
        let mut contenders = Vec::new();
        for rival in rivals(judged, *best)? {
            effects.push(rival.effect);
            group.rivals.push(rival.fit);
            contenders.extend(rival.contender);
        }
        contests.extend(judged.contest(contenders));
    }
    Ok((effects, contests))
}

/// The sentence on a search that was ended early.
fn cut_short(campaign: &Campaign) -> String {
    let by = if campaign.was_cut_short() {
        "by the bound on the samples that it may simulate, which --limit does not raise"
    } else {
        "by its time"
    };
    format!("The search was ended {by}: this is the best answer so far, and further causes may be there.")
}

/// Takes out the groups whose best is a lead if no more than noise is left without them; the leads' indices.
fn groups_of_leads(selection: &Selection, ambiguous: &mut Vec<Ambiguity>, noise: bool) -> Vec<usize> {
    let id_of = |index: usize| selection.fitted.point.hypothesis.members.get(index).map(|of| of.candidate.id);
    let is_best = |index: usize, group: &Ambiguity| group.ids.first().copied() == id_of(index);
    let grouped: Vec<usize> = selection
        .fitted
        .point
        .hypothesis
        .leads()
        .filter(|index| noise && ambiguous.iter().any(|group| is_best(*index, group)))
        .collect();
    ambiguous.retain(|group| !grouped.iter().any(|index| is_best(*index, group)));
    grouped
}

/// Indices of the members without an objection that are in no group of twins.
fn undisputed(selection: &Selection, against: &Against) -> Vec<usize> {
    let disputed = |id: EffectId| {
        against.doubts(id) || selection.ambiguous.iter().any(|(of, _)| *of == id) || against.is_geared(id)
    };
    let members = selection.fitted.point.hypothesis.members.iter().enumerate();
    members.filter(|(_, member)| !disputed(member.candidate.id)).map(|(index, _)| index).collect()
}

fn description(judged: &Judgement<'_>, left: &[PieceResidual], structure: &Structure) -> Description {
    let noise = judged.noise_where_it_counts();
    let mut orders = orders(&judged.setting, left, structure.per_independent);
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
    after: &[PieceResidual],
    structure: &Structure,
) -> Result<Vec<String>, DiagnosisError> {
    let campaign = judged.setting.campaign;
    let share_by = |names: &[&str]| {
        let shares = structure.dependences.iter().filter(|of| names.contains(&of.on.as_str()));
        shares.map(|of| of.share).fold(0.0, f64::max)
    };
    // Runs of other speeds differ too, wherever the model is wrong in speed.
    let as_they_move = share_by(&["speed", "acceleration"]) >= share_by(&["run"]);
    let by_run = |as_friction: bool| {
        let of_run = |of: &&Dependence| of.on == "run" && of.as_friction == as_friction;
        structure.dependences.iter().find(of_run).is_some_and(counts)
    };
    let open = matches!(verdict, Verdict::Unexplained | Verdict::PartlyExplained);
    let has_zeros = judged.setting.nuisances.zero_nm > 0.0;
    let differ = open && !as_they_move && by_run(true) && (has_zeros || by_run(false));
    let mut said = speed_with_pressure(campaign);
    if differ {
        said.extend(runs_differ(campaign, after, judged.scatter_of_zeros_nm()?));
    }
    // What depends on a recorded quantity repeats itself with that.
    if open && !depends(structure) && is_repeated(&judged.setting, after) {
        said.push(REPEATED.to_owned());
    }
    Ok(said)
}

/// Selected series over the angle that stand in for a gear, each with the gear's order.
fn geared(judged: &Judgement<'_>, left: &[PieceResidual], is_noise: bool) -> Vec<(EffectId, f64)> {
    let members = judged.selection.fitted.point.hypothesis.members.iter();
    let of = |member: &Member| {
        Some((member.candidate.id, order_of_a_gear(judged.setting.campaign, member, left, is_noise)?))
    };
    members.filter_map(of).collect()
}

/// The sentence on a tone. The tone may have the same amplitude at rest, where it counts as noise of the measurement.
fn hum(judged: &Judgement<'_>, tone: Tone) -> String {
    let amplitude = tone.amplitude * judged.noise_where_it_counts();
    let amplitude = match judged.setting.campaign.kind.channel {
        Channel::Torque => torque(amplitude),
        _ => format!("{amplitude:.1e} rad"),
    };
    format!(
        "What is left is mostly a tone of {:.1} Hz, amplitude {amplitude}: {:.0} % of it. No cause of the list hums: look for mains, a pump, or a structure that rings.",
        tone.hz,
        100.0 * tone.share
    )
}

/// The selected causes that were not accepted, if they remove more than half of the excess over noise.
fn nearest(judged: &Judgement<'_>, structure: &Structure) -> Result<Option<Nearest>, DiagnosisError> {
    let selection = &judged.selection;
    let removes = selection.share_explained(judged.setting.loss(), judged.noise.share);
    let members = selection.fitted.point.hypothesis.members.iter();
    let ids: Vec<EffectId> = members.map(|member| member.candidate.id).collect();
    let leaves_by = structure.dependences.iter().find(|of| counts(of));
    if removes <= MOST_OF_IT {
        return Ok(None);
    }
    let all = members_with_numbers(judged)?.into_iter();
    let parameters = all.map(|(_, effect, parameters)| (effect.id(), parameters)).collect();
    Ok(Some(Nearest { ids, parameters, removes, leaves_by: leaves_by.map(|of| of.on.clone()) }))
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

fn found(judged: &Judgement<'_>, diagnosis: Diagnosis, extended: Model, after: &[PieceResidual]) -> Found {
    let campaign = judged.setting.campaign;
    let pieces = campaign.pieces.iter().zip(&judged.before).zip(after);
    let shown = pieces.map(|((piece, before), after)| shown(judged, piece, before, after)).collect();
    Found {
        diagnosis,
        extended,
        channel: campaign.kind.channel,
        taken_off: judged.setting.nuisances.zero_nm > 0.0 || !campaign.hums.is_empty(),
        ranking: judged.selection.first_ranking.clone(),
        shown,
        proposed: Vec::new(),
        rivals: Vec::new(),
        contests: Vec::new(),
        samples: (campaign.samples, campaign.pieces.iter().map(Piece::len).sum()),
    }
}

fn shown(judged: &Judgement<'_>, piece: &Piece, before: &PieceResidual, after: &PieceResidual) -> Shown {
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
        measured: piece.as_recorded(&piece.measured),
        before: piece.as_recorded(&before.predicted),
        after: piece.as_recorded(&after.predicted),
        weights: piece.weights.clone(),
    }
}

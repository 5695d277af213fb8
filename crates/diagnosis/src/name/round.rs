//! One round of the forward selection: the most promising candidates are fitted, and the one with the least held-out error is
//! accepted if it passes the threshold.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::catalogue::candidate;
use crate::extend::hypothesis::Member;
use crate::extend::untestable::is_confounded;
use crate::fit::equations::Setting;
use crate::name::exchange::{COMPETED, MOST, in_place_of};
use crate::name::late::with_late_transducer;
use crate::name::rivals::{Rival, angle_between, as_good, as_good_within, fit_rival, fit_rivals, numbers};
use crate::name::screen::Screened;
use crate::name::selection::{Round, Selection};
use crate::name::threshold::{cut_of_squares, reaches_threshold};
use crate::name::tried::NEARLY;
use crate::name::turned::may_be_turned;
use crate::name::twins::missing;
use valve_model::EffectId;

/// Beside causes that are found a parameter of the model beyond its tolerance must leave less than any other cause by this part.
pub(crate) const LEVEL: f64 = 0.1;
/// A twin that these data can't tell apart is reported beside a cause if it explains this share of what the cause does.
const SIMILAR: f64 = 0.3;
/// Under model misfit, rivals within this part of the best gain count as equal.
const HARDLY: f64 = 0.1;
/// A twin is fitted for this if its linearised gain is this share of the best.
const WORTH: f64 = 0.05;

/// Fits rivals and accepts the one with the least held-out error; false if none passes the threshold.
pub(crate) fn next_cause(
    setting: &Setting<'_>,
    screened: &[Screened],
    state: &mut Selection,
) -> Result<bool, DiagnosisError> {
    let mut rivals = fit_rivals(setting, screened, state)?;
    rivals.sort_by(|a, b| a.rms.total_cmp(&b.rms));
    without_stand_ins(&mut rivals, state);
    let mut round = Round {
        rms_before: state.rms,
        rivals: rivals.iter().map(|rival| (rival.id, rival.rms)).collect(),
        equals: Vec::new(),
        accepted: None,
        rms_after: state.rms,
        others: Vec::new(),
    };
    let facts = &setting.campaign.facts;
    let chosen = rivals.first().and_then(|best| {
        // Under misfit, a gain difference below a tenth that is inconsistent across groups does not justify more parameters.
        let cut = if setting.campaign.has_misfit { HARDLY * (state.rms - best.rms) } else { 0.0 };
        let equal = |rival: &&Rival| as_good_within(best, rival, NEARLY.max(cut));
        // Among equals: the fewest free numbers, then one whose own channel varies in these data.
        let order = |rival: &Rival| (numbers(rival), is_confounded(rival.id, facts));
        rivals.iter().filter(equal).min_by(|a, b| order(a).cmp(&order(b)).then(a.rms.total_cmp(&b.rms)))
    });
    let pays = |rival: &&Rival| {
        reaches_threshold(state, (rival.id, rival.rms, &rival.held_out), 1.0, setting.loss())
    };
    let paying = chosen.filter(pays).cloned();
    let Some(chosen) = paying else {
        state.rounds.push(round);
        return Ok(false);
    };
    let chosen = with_late_transducer(setting, &chosen, &rivals)?.unwrap_or(chosen);
    let equals = look_alikes(setting, screened, state, (&chosen, &mut rivals))?;
    let chosen = &chosen;
    round.equals.clone_from(&equals);
    round.accepted = Some(chosen.id);
    round.rms_after = chosen.rms;
    let competed = rivals.iter().filter(|of| of.id != chosen.id && of.rms < COMPETED * chosen.rms).take(MOST);
    round.others = competed.filter_map(|of| of.fitted.point.hypothesis.members.last().cloned()).collect();
    for rival in rivals.iter().filter(|rival| equals.contains(&rival.id)) {
        let angle = angle_between(setting, &state.fitted.point, &chosen.fitted.point, &rival.fitted.point)?;
        state.angles.push((chosen.id, rival.id, angle));
        let fitted = rival.fitted.point.hypothesis.members.last().cloned();
        state.alternatives.extend(fitted.map(|member| (chosen.id, member)));
    }
    if !equals.is_empty() {
        state.ambiguous.push((chosen.id, equals));
    }
    let mut forms = state.forms;
    let cut = state.rms.powi(2) - chosen.rms.powi(2);
    forms.add(chosen.id, cut, cut_of_squares(state, &chosen.held_out));
    state.forms = forms;
    state.fitted = chosen.fitted.clone();
    state.held_out = chosen.held_out.clone();
    state.rms = chosen.rms;
    state.rounds.push(round);
    Ok(true)
}

/// Leaves out parameters of the model beyond their tolerance, beside other causes, that are not better by `LEVEL` than the best rival which is
/// none, or than nothing: they make up for what is not quite right in the causes' forms, a late transducer above all.
fn without_stand_ins(rivals: &mut Vec<Rival>, state: &Selection) {
    let before = &state.fitted.point.hypothesis;
    let is_number = |rival: &Rival| before.corrections.iter().any(|of| of.id == rival.id);
    let others = rivals.iter().filter(|rival| !is_number(rival)).map(|rival| rival.rms);
    let least = others.fold(state.rms, f64::min);
    if before.members.iter().any(|member| member.candidate.id != EffectId::SensorDelay) {
        rivals.retain(|rival| !is_number(rival) || rival.rms < (1.0 - LEVEL) * least);
    }
}

/// The effects that can't be told apart from the chosen one: equal held-out error, or twins whose separating data are missing.
/// Twins that have not been fitted yet are fitted here.
fn look_alikes(
    setting: &Setting<'_>,
    screened: &[Screened],
    state: &Selection,
    (chosen, rivals): (&Rival, &mut Vec<Rival>),
) -> Result<Vec<EffectId>, DiagnosisError> {
    let facts = &setting.campaign.facts;
    let explained = |rival: &Rival| state.rms.powi(2) - rival.rms.powi(2);
    let as_well = |rival: &Rival| as_good(chosen, rival) && numbers(rival) <= numbers(chosen);
    let mut group = vec![chosen.id];
    for rival in rivals.iter().filter(|rival| rival.id != chosen.id) {
        let simple = numbers(rival) <= numbers(chosen);
        if as_well(rival) || simple && may_be_turned(setting, chosen, rival)? {
            group.push(rival.id);
        }
    }
    let most = screened.first().map_or(0.0, |best| best.gain);
    let begun = group.clone();
    let lacking = |id: EffectId| begun.iter().any(|other| missing(*other, id, facts).is_some());
    for screened in screened.iter().filter(|of| lacking(of.member.candidate.id)) {
        let fitted = rivals.iter().any(|rival| rival.id == screened.member.candidate.id);
        let refused = state.dropped.iter().any(|(id, _)| *id == screened.member.candidate.id);
        if !fitted && !refused && screened.gain > WORTH * most {
            rivals.extend(if_possible(fit_rival(setting, screened, state, chosen.rms))?);
        }
    }
    // Numbers of the model are not screened beside their own corrections. One that does as well in the cause's place is a twin; one
    // that does a part of it is a correction at its bound.
    let corrections = chosen.fitted.point.hypothesis.corrections.iter();
    for number in corrections.map(|of| of.id).filter(|id| missing(chosen.id, *id, facts).is_some()) {
        if let Some(number) = candidate(number, facts).filter(|_| !setting.is_over()) {
            let member = Member::new(&number, number.neutral(), number.free.clone());
            let (place, begun) = (&chosen.fitted.point, &state.fitted.point.hypothesis.corrections);
            let tried = if_possible(in_place_of(setting, (place, begun), (chosen.id, &member)))?.flatten();
            let rival = tried.map(|tried| Rival::of(number.id, tried));
            rivals.extend(rival.filter(|rival| as_good(chosen, rival)));
        }
    }
    for rival in rivals.iter().filter(|rival| lacking(rival.id)) {
        let id = rival.id;
        if !group.contains(&id) && explained(rival) > SIMILAR * explained(chosen) {
            group.push(id);
        }
    }
    group.remove(0);
    Ok(group)
}

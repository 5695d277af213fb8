//! A round of the selection: the best of the screening fitted through the model, and the one taken that is best on what it
//! was not fitted on.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::candidate::Candidate;
use crate::extend::catalogue::is_confounded;
use crate::fit::equations::Setting;
use crate::fit::loss::Loss;
use crate::name::rivals::{Rival, angle_between, as_good, fit_rival, fit_rivals, numbers};
use crate::name::screen::Screened;
use crate::name::selection::{Round, Selection};
use crate::name::threshold::{cut_of_squares, cuts};
use crate::name::twins::missing;

/// A twin that these data can't tell apart is reported beside a cause where it explains this part of what that one does.
const SIMILAR: f64 = 0.3;
/// ... and it is fitted for that where its linearised gain is this part of the best.
const WORTH: f64 = 0.05;

/// Fits the best of the screening through the model and takes the one that is best on what it was not fitted on.
pub(crate) fn next_cause(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    screened: &[Screened],
    state: &mut Selection,
) -> Result<bool, DiagnosisError> {
    let mut rivals = fit_rivals(setting, candidates, screened, state)?;
    rivals.sort_by(|a, b| a.rms.total_cmp(&b.rms));
    let name = |rival: &Rival| candidates.get(rival.candidate).map_or("", |candidate| candidate.id);
    let mut round = Round {
        rms_before: state.rms,
        rivals: rivals.iter().map(|rival| (name(rival), rival.rms)).collect(),
        equals: Vec::new(),
        accepted: None,
    };
    let facts = &setting.campaign.facts;
    let chosen = rivals.first().and_then(|best| {
        let equal = |rival: &&Rival| as_good(best, rival);
        // Of equals the one with the fewest numbers, and of those one that could be tested by itself.
        let order = |rival: &Rival| (numbers(rival), is_confounded(name(rival), facts));
        rivals.iter().filter(equal).min_by(|a, b| order(a).cmp(&order(b)).then(a.rms.total_cmp(&b.rms)))
    });
    let pays =
        |rival: &&Rival| cuts(state, (name(rival), rival.rms, &rival.held_out), 1.0, Loss::of(setting));
    let paying = chosen.filter(pays).cloned();
    let Some(chosen) = paying else {
        state.rounds.push(round);
        return Ok(false);
    };
    let equals = look_alikes(setting, candidates, screened, state, (&chosen, &mut rivals))?;
    let chosen = &chosen;
    round.equals.clone_from(&equals);
    round.accepted = Some(name(chosen));
    for rival in rivals.iter().filter(|rival| equals.contains(&name(rival))) {
        let angle = angle_between(setting, &state.fitted.point, &chosen.fitted.point, &rival.fitted.point)?;
        state.angles.push((name(chosen), name(rival), angle));
    }
    if !equals.is_empty() {
        state.ambiguous.push((name(chosen), equals));
    }
    let mut forms = state.forms;
    let cut = state.rms.powi(2) - chosen.rms.powi(2);
    forms.add(name(chosen), cut, cut_of_squares(state, &chosen.held_out));
    state.forms = forms;
    state.fitted = chosen.fitted.clone();
    state.held_out = chosen.held_out.clone();
    state.rms = chosen.rms;
    state.rounds.push(round);
    Ok(true)
}

/// The names that can't be told from the one chosen: fitted as well, or twins whose separating data are missing. Twins not
/// fitted yet are.
fn look_alikes(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    screened: &[Screened],
    state: &Selection,
    (chosen, rivals): (&Rival, &mut Vec<Rival>),
) -> Result<Vec<&'static str>, DiagnosisError> {
    let facts = &setting.campaign.facts;
    let name = |index: usize| candidates.get(index).map_or("", |candidate| candidate.id);
    let explained = |rival: &Rival| state.rms.powi(2) - rival.rms.powi(2);
    let as_well = |rival: &Rival| as_good(chosen, rival) && numbers(rival) <= numbers(chosen);
    let mut group = vec![name(chosen.candidate)];
    let as_good_ones = rivals.iter().filter(|rival| as_well(rival)).map(|rival| name(rival.candidate));
    group.extend(as_good_ones.filter(|id| *id != name(chosen.candidate)));
    let most = screened.first().map_or(0.0, |best| best.gain);
    let begun = group.clone();
    let lacking = |id: &str| begun.iter().any(|other| missing(other, id, facts).is_some());
    for screened in screened.iter().filter(|of| lacking(name(of.candidate))) {
        let fitted = rivals.iter().any(|rival| rival.candidate == screened.candidate);
        if !fitted && screened.gain > WORTH * most {
            rivals.extend(if_possible(fit_rival(setting, screened, state, chosen.rms))?);
        }
    }
    for rival in rivals.iter().filter(|rival| lacking(name(rival.candidate))) {
        let id = name(rival.candidate);
        if !group.contains(&id) && explained(rival) > SIMILAR * explained(chosen) {
            group.push(id);
        }
    }
    group.remove(0);
    Ok(group)
}

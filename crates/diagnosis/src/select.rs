//! Which causes are accepted: rivals screened by sensitivities, fitted through the model, judged on runs that they were
//! not fitted on, one after the other; earlier ones are dropped when they no longer pay.

use crate::DiagnosisError;
use crate::candidate::Candidate;
use crate::fit::Fitted;
use crate::gram::HeldOut;
use crate::hypothesis::Member;
use crate::linear::{Point, Setting};
use crate::loss::Loss;
use crate::measure::left;
use crate::pattern::search;
use crate::refine::refine;
use crate::rivals::{
    NEARLY, Rival, STEPS, Tried, angle_between, as_good, fit_rival, fit_rivals, fitted_pieces, judge, numbers,
};
use crate::screen::{Screened, screen};
use crate::simplify::simplify;
use crate::table::is_confounded;
use crate::twins::missing;
use crate::whiteness::is_white;

/// A cause must cut the held-out RMS by so much, in parts of the noise.
pub(crate) const FLOOR: f64 = 0.01;
/// ... and by so much of what all causes of an open form explain, as a mean square: below it lies the misfit of a form.
const SHARE: f64 = 0.02;
/// Causes whose form leaves nothing open: nothing that they leave is a misfit of theirs.
const EXACT: [&str; 2] = ["pressure-torque", "torque-offset"];
/// A twin that these data can't tell apart is reported beside a cause where it explains this part of what that one does.
const SIMILAR: f64 = 0.3;
/// ... and it is fitted for that where its linearised gain is this part of the best.
const WORTH: f64 = 0.05;
/// Causes at most.
const MOST: usize = 6;

/// What was decided in one round.
#[derive(Debug, Clone)]
pub(crate) struct Round {
    pub rms_before: f64,
    /// Name and held-out RMS of every rival that was fitted, best first.
    pub rivals: Vec<(&'static str, f64)>,
    /// The names that can't be told apart from the best; empty where it stands alone.
    pub equals: Vec<&'static str>,
    pub accepted: Option<&'static str>,
}

/// What came out.
#[derive(Debug, Clone)]
pub(crate) struct Selection {
    pub fitted: Fitted,
    pub held_out: HeldOut,
    pub rms_first: f64,
    pub rms: f64,
    /// What was held out at first.
    pub held_out_first: HeldOut,
    /// What causes of an open form explain, as a mean square in parts of the noise's.
    pub explained_by_form: f64,
    pub rounds: Vec<Round>,
    /// Groups of names of which one is needed; its representative is a member of the hypothesis.
    pub ambiguous: Vec<(&'static str, Vec<&'static str>)>,
    /// For each pair of names that can't be told apart, the angle between what they change, degrees.
    pub angles: Vec<(&'static str, &'static str, f64)>,
    /// Gains of the first screening, best first.
    pub first_ranking: Vec<(&'static str, f64)>,
    pub dropped: Vec<(&'static str, String)>,
}

impl Selection {
    /// Goes on from another hypothesis.
    pub fn take(&mut self, tried: Tried) {
        (self.fitted, self.held_out, self.rms) = (tried.fitted, tried.held_out, tried.rms);
    }

    /// What the causes explain on what they were not fitted on, as a mean square in parts of the noise's.
    pub fn explained(&self) -> f64 {
        let count: f64 = self.fitted.groups.iter().map(|group| group.count).sum();
        (self.held_out_first.total() - self.held_out.total()) / count.max(1.0)
    }

    /// The part of what is beyond noise that the causes explain on what they were not fitted on.
    pub fn share_explained(&self, loss: Loss) -> f64 {
        let groups = &self.fitted.groups;
        let first = self.held_out_first.each(groups);
        let pairs = first.zip(&self.held_out.squares).map(|((first, count), now)| (first, *now, count));
        loss.share_explained(pairs)
    }

    /// Whether a third cause or a further one cuts the plain squares by more than the forms of those that are in leave of
    /// them; logarithms hide how little that is.
    pub fn is_no_misfit(&self, rival: &Rival) -> bool {
        let few = self.fitted.point.hypothesis.members.len() < 2;
        let count: f64 = self.fitted.groups.iter().map(|group| group.count).sum();
        let cut = (self.held_out.total() - rival.held_out.total()) / count.max(1.0);
        few || self.explained_by_form == 0.0 || cut >= SHARE * self.explained()
    }

    /// By how much a cause must cut the held-out RMS, in parts of the noise.
    pub fn least_cut(&self, loss: Loss) -> f64 {
        let square = self.rms.powi(2);
        let least = (SHARE * self.explained_by_form)
            .max(loss.least_part(self.fitted.point.hypothesis.members.len()) * (square - 1.0));
        FLOOR.max(self.rms - (square - least).max(0.0).sqrt())
    }
}

/// Who is told a ranking: the effects, and how well each explains the residual.
pub(crate) type Tell<'a> = dyn FnMut(&[(&'static str, f64)]) + 'a;

/// Looks for causes from `begin` on; those of `earlier` are in at first, and stay as far as they pay.
pub(crate) fn select(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    begin: Fitted,
    earlier: Option<&Selection>,
    tell: &mut Tell<'_>,
) -> Result<Selection, DiagnosisError> {
    let held_out = judge(setting, &begin.groups);
    let loss = Loss::of(setting);
    let rms_first = loss.rms(held_out.each(&begin.groups));
    let mut state = Selection {
        fitted: begin,
        held_out_first: held_out.clone(),
        held_out,
        rms_first,
        rms: rms_first,
        explained_by_form: 0.0,
        rounds: Vec::new(),
        ambiguous: Vec::new(),
        angles: Vec::new(),
        first_ranking: Vec::new(),
        dropped: Vec::new(),
    };
    if let Some(earlier) = earlier {
        take_over(setting, earlier, &mut state)?;
    }
    for round in 0..MOST {
        if is_white(setting, &left(setting, &state.fitted.point)?) {
            break;
        }
        let screened = screen(setting, candidates, &state.fitted)?;
        if round == 0 {
            state.first_ranking =
                screened.iter().filter_map(|s| candidates.get(s.candidate).map(|c| (c.id, s.gain))).collect();
            tell(&state.first_ranking);
        }
        if !next_cause(setting, candidates, &screened, &mut state)? {
            break;
        }
        refine(setting, &mut state)?;
        tell_asymmetry_from_offset(&mut state);
        fit_earlier_ones(setting, &mut state)?;
        drop_idle(setting, &mut state)?;
        simplify(setting, candidates, &mut state)?;
    }
    Ok(state)
}

/// Where much is left, the causes that were in before the last one came are fitted once more beside it, each by a pattern
/// search: what an early end of their fit leaves would be picked up by a cause that isn't there.
fn fit_earlier_ones(setting: &Setting<'_>, state: &mut Selection) -> Result<(), DiagnosisError> {
    for member in 0..state.fitted.point.hypothesis.members.len().saturating_sub(1) {
        if let Some(better) = search(setting, &state.fitted, member, &fitted_pieces)? {
            let tried = Tried::from(setting, better, STEPS)?;
            if tried.fitted.loss < state.fitted.loss {
                state.take(tried);
            }
        }
    }
    Ok(())
}

/// An asymmetry whose viscous part pays grows with speed; a torque of one sign that fitted worse is no twin then.
fn tell_asymmetry_from_offset(state: &mut Selection) {
    const VISCOUS: usize = 1;
    let asymmetry = "direction-asymmetry";
    let viscous = |member: &Member| member.candidate.id == asymmetry && member.free.contains(&VISCOUS);
    if !state.fitted.point.hypothesis.members.last().is_some_and(viscous) {
        return;
    }
    let Some(round) = state.rounds.last_mut() else { return };
    let rms_of = |id: &str| round.rivals.iter().find(|rival| rival.0 == id).map(|rival| rival.1);
    let worse =
        |id: &&str| rms_of(id).zip(rms_of(asymmetry)).is_some_and(|(other, own)| other - own > NEARLY);
    for id in ["torque-offset", "pressure-torque"].iter().filter(|id| worse(id)) {
        round.equals.retain(|of| of != id);
        for (_, others) in state.ambiguous.iter_mut().filter(|(of, _)| *of == asymmetry) {
            others.retain(|of| of != id);
        }
    }
    state.ambiguous.retain(|(_, others)| !others.is_empty());
}

/// Begins with causes that were found before, fitted anew.
fn take_over(
    setting: &Setting<'_>,
    earlier: &Selection,
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    let tried = Tried::from(setting, earlier.fitted.point.clone(), 8)?;
    let open =
        tried.fitted.point.hypothesis.members.iter().any(|member| !EXACT.contains(&member.candidate.id));
    if open {
        state.explained_by_form =
            earlier.explained_by_form.min(state.rms.powi(2) - tried.rms.powi(2)).max(0.0);
    }
    state.take(tried);
    state.ambiguous.clone_from(&earlier.ambiguous);
    state.angles.clone_from(&earlier.angles);
    state.rounds.clone_from(&earlier.rounds);
    drop_idle(setting, state)
}

/// Fits the best of the screening through the model and takes the one that is best on what it was not fitted on.
fn next_cause(
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
    let pays = |rival: &&Rival| {
        state.rms - rival.rms >= state.least_cut(Loss::of(setting)) && state.is_no_misfit(rival)
    };
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
    if !EXACT.contains(&name(chosen)) {
        state.explained_by_form += state.rms.powi(2) - chosen.rms.powi(2);
    }
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
            rivals.push(fit_rival(setting, screened, state, chosen.rms)?);
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

/// Drops causes that no longer pay beside the others.
fn drop_idle(setting: &Setting<'_>, state: &mut Selection) -> Result<(), DiagnosisError> {
    while state.fitted.point.hypothesis.members.len() > 1 {
        let mut idlest: Option<(usize, Tried)> = None;
        for index in 0..state.fitted.point.hypothesis.members.len() {
            let begin = Point {
                hypothesis: state.fitted.point.hypothesis.without(index),
                starts: state.fitted.point.starts.clone(),
            };
            let without = Tried::from(setting, begin, 6)?;
            if idlest.as_ref().is_none_or(|(_, least)| without.rms < least.rms) {
                idlest = Some((index, without));
            }
        }
        let Some((index, without)) = idlest else { break };
        let worth = without.rms.powi(2) - state.rms.powi(2);
        if without.rms - state.rms >= FLOOR && worth >= SHARE * state.explained_by_form {
            break;
        }
        if let Some(member) = state.fitted.point.hypothesis.members.get(index) {
            let id = member.candidate.id;
            let reason = "no longer cuts the error on held-out runs once the other causes are in".to_owned();
            state.dropped.push((id, reason));
            state.ambiguous.retain(|(representative, _)| *representative != id);
        }
        state.take(without);
    }
    Ok(())
}

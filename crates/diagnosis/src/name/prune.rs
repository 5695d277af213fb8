//! Pruning after a cause is accepted: the earlier causes are fitted again, and dropped if they no longer gain.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::hypothesis::Member;
use crate::fit::equations::{Point, Setting};
use crate::name::forms::MISFIT;
use crate::name::selection::Selection;
use crate::name::threshold::{FLOOR, hysteresis_keeps_shrinking, reaches_threshold};
use crate::name::tried::{NEARLY, Tried};
use valve_model::EffectId;

/// Where the residual is far above noise, fits each earlier cause again by a pattern search: if its fit ended too early, its
/// residual would be attributed to a cause that doesn't exist.
pub(crate) fn fit_earlier_ones(setting: &Setting<'_>, state: &mut Selection) -> Result<(), DiagnosisError> {
    for member in 0..state.causes().saturating_sub(1) {
        if setting.is_over() {
            break;
        }
        let now = Tried { fitted: state.fitted.clone(), held_out: state.held_out.clone(), rms: state.rms };
        state.take(now.searched(setting, member)?);
    }
    Ok(())
}

/// An asymmetry with a viscous part grows with speed. A constant torque that fitted worse is then no twin of it.
pub(crate) fn tell_asymmetry_from_offset(state: &mut Selection) {
    const VISCOUS: usize = 1;
    let asymmetry = EffectId::DirectionAsymmetry;
    let viscous = |member: &Member| member.candidate.id == asymmetry && member.free.contains(&VISCOUS);
    if !state.fitted.point.hypothesis.members.last().is_some_and(viscous) {
        return;
    }
    let Some(round) = state.rounds.last_mut() else { return };
    let rms_of = |id: EffectId| round.rivals.iter().find(|rival| rival.0 == id).map(|rival| rival.1);
    let worse =
        |id: &EffectId| rms_of(*id).zip(rms_of(asymmetry)).is_some_and(|(other, own)| other - own > NEARLY);
    for id in [EffectId::TorqueOffset, EffectId::PressureTorque].into_iter().filter(worse) {
        round.equals.retain(|of| *of != id);
        for (_, others) in state.ambiguous.iter_mut().filter(|(of, _)| *of == asymmetry) {
            others.retain(|of| *of != id);
        }
    }
    state.ambiguous.retain(|(_, others)| !others.is_empty());
}

/// Drops causes that no longer gain beside the others.
pub(crate) fn drop_idle(setting: &Setting<'_>, state: &mut Selection) -> Result<(), DiagnosisError> {
    while state.causes() > 1 && !setting.is_over() {
        let mut without = Vec::new();
        for index in 0..state.causes() {
            let begin = Point {
                hypothesis: state.fitted.point.hypothesis.without(index),
                starts: state.fitted.point.starts.clone(),
            };
            without.extend(if_possible(Tried::from(setting, begin, 6))?.map(|tried| (index, tried)));
        }
        let Some((index, without)) = idle(setting, state, without) else { break };
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

/// The index of a cause to drop, with the fit without it: the last cause if it only fits presliding-hysteresis' misfit, else the
/// one whose removal costs least, if that is below the threshold.
fn idle(
    setting: &Setting<'_>,
    state: &Selection,
    mut without: Vec<(usize, Tried)>,
) -> Option<(usize, Tried)> {
    without.sort_by(|a, b| a.1.rms.total_cmp(&b.1.rms));
    let picked = without.iter().position(|(index, tried)| is_picked(setting, state, *index, tried));
    let of_no_worth = |(_, tried): &&(usize, Tried)| {
        let worth = tried.rms.powi(2) - state.rms.powi(2);
        tried.rms - state.rms < FLOOR || worth < MISFIT * state.forms.inexact
    };
    let place = picked.or(without.first().filter(of_no_worth).map(|_| 0))?;
    without.into_iter().nth(place)
}

/// True if the last cause only fits the misfit of presliding-hysteresis: against the others fitted for as long, it is below the
/// acceptance threshold.
fn is_picked(setting: &Setting<'_>, state: &Selection, index: usize, without: &Tried) -> bool {
    let members = &state.fitted.point.hypothesis.members;
    let Some(last) = members.get(index).filter(|_| index + 1 == members.len()) else { return false };
    let before = Selection {
        fitted: without.fitted.clone(),
        held_out: without.held_out.clone(),
        rms: without.rms,
        ..state.clone()
    };
    let loss = setting.loss();
    hysteresis_keeps_shrinking(&before, loss)
        && !reaches_threshold(&before, (last.candidate.id, state.rms, &state.held_out), 1.0, loss)
}

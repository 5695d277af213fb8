//! Doubt: whether the selected causes leave so large a residual that they may stand in for a cause that is not on the list.

use crate::DiagnosisError;
use crate::extend::hypothesis::Member;
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::{Fitted, fit};
use crate::log::piece::Piece;
use crate::measure::covariates::goes_by;
use crate::measure::judgement::Judgement;
use crate::name::forms::MISFIT;
use crate::numerics::statistics::{CHANCE, SHARE_LEFT};
use crate::outcome::Dependence;
use crate::show::colour::is_coloured;
use crate::show::own_zeros::zeros_hold;
use crate::show::residual::{PieceResidual, left, rms_as_fitted};
use crate::show::structure::{Structure, structure};
use crate::show::whiteness::is_white;
use valve_model::EffectId;

/// The residual counts as noise up to this RMS, relative to the noise, plus `DEVIATIONS` of its standard deviations, if no covariate
/// explains more than `SHARE_LEFT` of it.
const RMS_LEFT: f64 = 1.1;
const DEVIATIONS: f64 = 3.0;
/// The share of the excess over noise that one cause, or several together, must explain to be accepted. Several have more free
/// parameters, so they must explain more.
const EXPLAINED: f64 = 0.5;
const EXPLAINED_TOGETHER: f64 = 0.7;
/// If the residual exceeds the misfit of the causes' forms, one covariate that explains this share of it points to a
/// further cause.
const ANOTHER: f64 = 0.15;
/// Causes of a general form: they can follow any function of the variable that they depend on. If only such causes are
/// selected, their residual must be at most `LITTLE` of what they explain.
const GENERAL: [EffectId; 6] = [
    EffectId::AngleDependentFriction,
    EffectId::TorqueOffset,
    EffectId::TorqueGain,
    EffectId::PressureTorque,
    EffectId::PositionTorque,
    EffectId::FlowTorque,
];
const LITTLE: f64 = 0.1;
/// A single cause of another form counts as the largest part of the discrepancy if its residual is at most this fraction of
/// what it explains, whatever the residual depends on: real friction also differs a little from run to run. Several causes can
/// imitate an unmodelled one more easily, so they have no such allowance.
const OF_ONE: f64 = 0.05;
/// Covariates that are confounded with others: they differ between runs, or grow with time, whatever the cause.
const BY_RUN: [&str; 4] = ["run", "motion", "time since rest", "distance travelled"];
/// Steps of the fit of only those causes that there is no evidence against.
const STEPS: usize = 8;
/// A residual of more than this many times the noise is a misfit of the model.
const MISFITS: f64 = 2.0;

/// A residual that is a misfit of the model.
pub(crate) struct Misfit {
    /// By piece.
    pub left: Vec<Vec<f64>>,
    /// Autocorrelated samples of it that count as one independent sample.
    pub per_independent: f64,
}

/// The residual after the selected causes if it is a misfit of the model: more than `MISFITS` times the noise of a torque log,
/// while the causes are not doubtful.
pub(crate) fn misfit(judged: &Judgement<'_>) -> Result<Option<Misfit>, DiagnosisError> {
    let selected = !judged.selection.fitted.point.hypothesis.members.is_empty();
    if !selected || !judged.setting.campaign.kind.motion_errs {
        return Ok(None);
    }
    let (_, left) = judged.everywhere(&judged.selection.fitted)?;
    let structure = structure(&judged.setting, &left);
    let misfit = structure.rms > MISFITS && !is_doubtful(judged, &left, &structure, judged.setting.is_over());
    let left = || left.into_iter().map(|of| of.residual).collect();
    Ok(misfit.then(|| Misfit { left: left(), per_independent: structure.per_independent }))
}

/// True if the selected causes leave too large a residual to be the cause. `is_over`: nothing more could be searched for.
pub(crate) fn is_doubtful(
    judged: &Judgement<'_>,
    left: &[PieceResidual],
    structure: &Structure,
    is_over: bool,
) -> bool {
    let selection = &judged.selection;
    if selection.fitted.point.hypothesis.members.is_empty() {
        return false;
    }
    let loss = judged.setting.loss();
    let on_held_out = part_left_on_held_out(judged, left);
    let no_better = on_held_out >= 1.0 && selection.rms_first < RMS_LEFT;
    let too_little = || {
        selection.share_explained(loss, judged.noise.share) < least_share(selection.causes())
            // If the search was cut short, it had no time for the other cause.
            || judged.noise.share == 1.0 && !is_over && another_cause(judged, structure)
            || on_held_out > loss.hardly_less()
    };
    no_better || !(is_noise(structure) && judged.noise.share == 1.0) && too_little()
}

/// Indices of those doubtful causes that there is no evidence against: the residual shows no structure over their own
/// covariates, and they remove at least as much as a free function of any covariate that is not theirs. The residual then
/// belongs to a further cause.
pub(crate) fn spared(judged: &Judgement<'_>, structure: &Structure) -> Result<Vec<usize>, DiagnosisError> {
    let members = &judged.selection.fitted.point.hypothesis.members;
    let right = |(_, member): &(usize, &Member)| has_right_form(member, structure);
    let places: Vec<usize> = members.iter().enumerate().filter(right).map(|(place, _)| place).collect();
    if places.is_empty() {
        return Ok(places);
    }
    let kept: Vec<Member> = places.iter().filter_map(|place| members.get(*place).cloned()).collect();
    let ids: Vec<EffectId> = kept.iter().map(|member| member.candidate.id).collect();
    let mut point = judged.selection.fitted.point.clone();
    point.hypothesis.members = kept;
    let begin = Point { hypothesis: point.hypothesis, starts: point.starts };
    let alone = fit(&judged.setting, begin, &Piece::is_fitted, STEPS)?;
    let (_, left_alone) = judged.everywhere(&alone)?;
    // Refitted alone: the other causes may have compensated for a wrong form.
    let structure_alone = self::structure(&judged.setting, &left_alone);
    if !alone.point.hypothesis.members.iter().all(|member| has_right_form(member, &structure_alone)) {
        return Ok(Vec::new());
    }
    let rms = |left: &[PieceResidual]| rms_as_fitted(&judged.setting, left, &|_: &Piece| true);
    let (before, after) = (rms(&judged.before).powi(2), rms(&left_alone).powi(2));
    let removed = (before - after) / (before - 1.0).max(f64::MIN_POSITIVE);
    let largest = removed > least_share(ids.len())
        && part_left_on_held_out(judged, &left_alone) < judged.setting.loss().hardly_less();
    // A cause that can follow any function of its variable would have fitted its own effect.
    let general = ids.iter().all(|id| GENERAL.contains(id)) && after - 1.0 > LITTLE * (before - after);
    let best = !general && 1.0 - after / before >= best_of_others(&judged.structure_before, &ids);
    Ok(if largest && best { places } else { Vec::new() })
}

/// Whether the residual is independent of every covariate that the cause is a function of.
fn has_right_form(member: &Member, structure: &Structure) -> bool {
    let own = structure.dependences.iter().filter(|of| of.p_value < CHANCE);
    let own = own.filter(|of| goes_by(member.candidate.id, &of.on)).map(|of| of.share).fold(0.0, f64::max);
    own * structure.rms.powi(2) <= ANOTHER * (structure.rms.powi(2) - 1.0)
}

/// The largest share of the given model's residual that a free function of one covariate explains, of those that none of these
/// causes depends on.
fn best_of_others(before: &Structure, ids: &[EffectId]) -> f64 {
    let other = |of: &&Dependence| {
        of.p_value < CHANCE && !BY_RUN.contains(&of.on.as_str()) && !ids.iter().any(|id| goes_by(*id, &of.on))
    };
    before.dependences.iter().filter(other).map(|of| of.share).fold(0.0, f64::max)
}

fn least_share(causes: usize) -> f64 {
    if causes > 1 { EXPLAINED_TOGETHER } else { EXPLAINED }
}

/// The ratio of the held-out RMS with the causes to that without; 0 without held-out runs.
fn part_left_on_held_out(judged: &Judgement<'_>, left: &[PieceResidual]) -> f64 {
    let held_out = |piece: &Piece| piece.hold_out;
    let rms = |left: &[PieceResidual]| rms_as_fitted(&judged.setting, left, &held_out);
    let before = rms(&judged.before);
    if before > 0.0 { rms(left) / before } else { 0.0 }
}

/// True if the residual is large and structured: the causes then stand in for one that is not on the list.
fn another_cause(judged: &Judgement<'_>, structure: &Structure) -> bool {
    let selection = &judged.selection;
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
    let most = if ids.len() == 1 { OF_ONE } else { MISFIT };
    left > most * explained && share * structure.rms.powi(2) > ANOTHER * left
}

/// True if none of the selected causes depends on this covariate, so that a residual that does points to a further
/// cause. Any cause may depend on speed, acceleration or run.
fn is_of_another(ids: &[EffectId], on: &str) -> bool {
    let telling = on.starts_with("angle") || on == "pressure" || on == "temperature";
    telling && !ids.iter().any(|id| goes_by(*id, on))
}

/// Whether a fit leaves no more than noise, coloured or not, and zeros of each run hide nothing that is more.
pub(crate) fn leaves_noise(setting: &Setting<'_>, fitted: &Fitted) -> Result<bool, DiagnosisError> {
    let left = left(setting, &fitted.point)?;
    let is_noise = is_white(setting, &left) || {
        let structure = structure(setting, &left);
        is_noise(&structure) || is_coloured(setting, &left, &structure)
    };
    Ok(is_noise && zeros_hold(setting, &fitted.point)?)
}

/// Whether a residual is no more than noise.
pub(crate) fn is_noise(structure: &Structure) -> bool {
    // Below the noise, shares are relative to the noise variance, so that a large share of a small residual is not significant.
    let square = structure.rms.powi(2).min(1.0);
    let depends =
        structure.dependences.iter().any(|of| of.share * square > SHARE_LEFT && of.p_value < CHANCE);
    is_as_loud_as_noise(structure) && !depends
}

/// Whether a residual is no larger than noise, whatever it depends on.
pub(crate) fn is_as_loud_as_noise(structure: &Structure) -> bool {
    // An RMS of few samples is itself uncertain.
    structure.rms <= RMS_LEFT + DEVIATIONS / (2.0 * structure.count).sqrt()
}

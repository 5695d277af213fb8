//! Doubt: whether the selected causes leave so much that they may stand in for one that is not on the list.

use crate::DiagnosisError;
use crate::extend::hypothesis::Member;
use crate::fit::equations::Point;
use crate::fit::gauss_newton::fit;
use crate::log::piece::Piece;
use crate::measure::covariates::goes_by;
use crate::measure::judgement::Judgement;
use crate::name::forms::MISFIT;
use crate::numerics::statistics::{CHANCE, SHARE_LEFT};
use crate::outcome::Dependence;
use crate::show::residual::{PieceResidual, rms_as_fitted};
use crate::show::structure::{Structure, structure};
use valve_model::EffectId;

/// The residual counts as noise up to this RMS, in parts of the noise, if no covariate explains more than this share of
/// it.
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
const LITTLE: f64 = 0.1;
/// A single cause of another form is the largest part of what is wrong where its residual is at most this part of what it explains,
/// whatever that goes by: real friction differs a little from run to run besides. Several causes can imitate an unmodelled one more
/// easily, so they have no such allowance.
const OF_ONE: f64 = 0.05;
/// Covariates that other covariates hide behind: they differ between runs, or grow with time, whatever the cause.
const BY_RUN: [&str; 4] = ["run", "motion", "time since rest", "distance travelled"];
/// Steps of the fit of those causes alone that nothing speaks against.
const STEPS: usize = 8;
/// A residual so many times the noise is a misfit of the model.
const MISFITS: f64 = 2.0;

/// A residual that is a misfit of the model.
pub(crate) struct Misfit {
    /// By piece.
    pub left: Vec<Vec<f64>>,
    /// How many neighbours of it are worth one sample.
    pub per_independent: f64,
}

/// What the selected causes leave where that is a misfit: more than `MISFITS` times the noise of a torque log, and nothing speaks
/// against the causes.
pub(crate) fn misfit(judged: &Judgement<'_>) -> Result<Option<Misfit>, DiagnosisError> {
    let selected = !judged.selection.fitted.point.hypothesis.members.is_empty();
    if !selected || !judged.setting.campaign.kind.motion_is_measured {
        return Ok(None);
    }
    let (_, left) = judged.everywhere(&judged.selection.fitted)?;
    let structure = structure(&judged.setting, &left);
    let misfit = structure.rms > MISFITS && !is_doubtful(judged, &left, &structure);
    let left = || left.into_iter().map(|of| of.residual).collect();
    Ok(misfit.then(|| Misfit { left: left(), per_independent: structure.per_independent }))
}

/// True if the selected causes leave too large a residual to be the cause.
pub(crate) fn is_doubtful(judged: &Judgement<'_>, left: &[PieceResidual], structure: &Structure) -> bool {
    let selection = &judged.selection;
    if selection.fitted.point.hypothesis.members.is_empty() {
        return false;
    }
    let loss = judged.setting.loss();
    let on_held_out = part_left_on_held_out(judged, left);
    let no_better = on_held_out >= 1.0 && selection.rms_first < RMS_LEFT;
    let too_little = || {
        selection.share_explained(loss, judged.noise.share) < least_share(selection.fitted.point.hypothesis.members.len())
            // A search that was cut short had no time for the other cause.
            || judged.noise.share == 1.0 && !judged.setting.is_over() && another_cause(judged, structure)
            || on_held_out > loss.hardly_less()
    };
    no_better || !(is_noise(structure) && judged.noise.share == 1.0) && too_little()
}

/// Those doubtful causes with no evidence against them, by their places: the residual shows no structure over their own covariates, and
/// they remove at least as much as a free function of any covariate that is not theirs. What is left then belongs to a further cause.
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
    // A form that takes any function of its variable would have fitted its own cause.
    let general = ids.iter().all(|id| GENERAL.contains(id)) && after - 1.0 > LITTLE * (before - after);
    let best = !general && 1.0 - after / before >= best_of_others(&judged.structure_before, &ids);
    Ok(if largest && best { places } else { Vec::new() })
}

/// Whether what is left does not go by a covariate that the cause is a function of.
fn has_right_form(member: &Member, structure: &Structure) -> bool {
    let own = structure.dependences.iter().filter(|of| of.p_value < CHANCE);
    let own = own.filter(|of| goes_by(member.candidate.id, &of.on)).map(|of| of.share).fold(0.0, f64::max);
    own * structure.rms.powi(2) <= ANOTHER * (structure.rms.powi(2) - 1.0)
}

/// The largest share of the given model's residual that a free function of a covariate explains which none of these causes goes by.
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

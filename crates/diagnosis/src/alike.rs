//! Causes that explain a log as well as a number of the model that is off, fitted in its place.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::Member;
use crate::fit::equations::{Point, Setting};
use crate::fit::gauss_newton::Fitted;
use crate::measure::doubt::leaves_noise;
use crate::name::screen::screen;
use crate::name::tried::{STEPS, Tried};
use crate::name::twins::missing;
use valve_model::EffectId;

/// Steps of the fit of a parameter beyond its tolerance before it is decided whether noise is within reach.
const FIRST_STEPS: usize = 2;
/// After its first steps it may leave so many times what the cause leaves.
const HOPELESS: f64 = 1.5;
/// An alternative is not tried if its linearised residual RMS exceeds that of the cause by more than this, in noise RMS.
const FAR_OFF: f64 = 0.03;

/// The fit of a cause beside the corrections, without the correction of the same parameter, in so many steps; `None` if it can't be predicted.
pub(crate) fn with_member(
    setting: &Setting<'_>,
    corrected: &Fitted,
    member: Member,
    steps: usize,
) -> Result<Option<Tried>, DiagnosisError> {
    let hypothesis = corrected.point.hypothesis.with_uncorrected(member);
    let begin = Point { hypothesis, starts: corrected.point.starts.clone() };
    if_possible(Tried::from(setting, begin, steps))
}

/// The same, if it leaves no more than noise.
pub(crate) fn if_noise_is_left(
    setting: &Setting<'_>,
    corrected: &Fitted,
    member: Member,
    hopeless: f64,
) -> Result<Option<Tried>, DiagnosisError> {
    // The prediction is nearly linear in such causes: if a few steps end far above noise, more steps would not reach it.
    let Some(tried) = with_member(setting, corrected, member, FIRST_STEPS)? else { return Ok(None) };
    if tried.rms > hopeless {
        return Ok(None);
    }
    let tried = tried.further(setting, STEPS)?;
    Ok(if leaves_noise(setting, &tried.fitted)? { Some(tried) } else { None })
}

/// The twins of a cause that these data can't tell from it, fitted in its place, if they leave no more than noise too. Only twins
/// whose linearised gain is close to that of the cause are fitted.
///
/// The other numbers begin where they are beside the cause. Fitted without it, they would have gone to their bounds in its place.
pub(crate) fn twins_in_place_of(
    setting: &Setting<'_>,
    able: &[Candidate],
    (cause, fitted): (EffectId, &Tried),
) -> Result<Vec<(EffectId, Tried)>, DiagnosisError> {
    let facts = &setting.campaign.facts;
    let point = &fitted.fitted.point;
    let is_number = |id: EffectId| point.hypothesis.corrections.iter().any(|of| of.id == id);
    let is_twin = |of: &&Candidate| {
        missing(cause, of.id, facts).is_some() && !is_number(of.id) && !point.hypothesis.has(of.id)
    };
    let twins: Vec<Candidate> = able.iter().filter(is_twin).cloned().collect();
    let place = point.hypothesis.members.iter().position(|member| member.candidate.id == cause);
    let Some(place) = place.filter(|_| !twins.is_empty() && !setting.is_over()) else {
        return Ok(Vec::new());
    };
    let without = Point { hypothesis: point.hypothesis.without(place), starts: point.starts.clone() };
    let Some(without) = if_possible(Tried::from(setting, without, 0))? else { return Ok(Vec::new()) };
    let smooth = setting.campaign.kind.smooth;
    let (mut found, hopeless) =
        (Vec::new(), if smooth { fitted.rms + FAR_OFF } else { fitted.rms * HOPELESS });
    for screened in screen(setting, &twins, &without.fitted)?.ranked {
        // A predicted rotor slips at another moment instead: what a gain promises to first order is little of what it brings.
        if setting.is_over() || smooth && without.rms - screened.gain > hopeless {
            break;
        }
        let id = screened.member.candidate.id;
        let tried = if_noise_is_left(setting, &without.fitted, screened.member, hopeless)?;
        found.extend(tried.map(|tried| (id, tried)));
    }
    Ok(found)
}

//! Which of the laws found are told: those that hold on the runs held out, without causes that they make idle.

use crate::DiagnosisError;
use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::{Free, Hypothesis, Member};
use crate::fit::equations::Point;
use crate::fit::spread::spread;
use crate::measure::covariates::goes_by;
use crate::measure::judgement::Judgement;
use crate::outcome::Cause;
use crate::show::residual::PieceResidual;
use crate::unnamed::kept::Kept;
use crate::unnamed::passed_once::{goes_by_time, passed_once};
use crate::unnamed::search::{Laws, without};
use crate::unnamed::searched::{Searched, alone_leave_noise, beside_or_instead};
use crate::unnamed::stand_in::{stays, without_stand_ins};
use crate::unnamed::told::{Extended, told};
use valve_model::EffectId;

/// A transducer counts as late from this many standard errors on.
const CLEAR: f64 = 2.0;

/// Searches for laws beside the accepted causes, in place of groups that the data can't tell apart, each with its best one first.
/// `None` if there are none, or they don't hold on the runs that were held out, or none were, or a group does something beside them.
pub(crate) fn unnamed(
    judged: &Judgement<'_>,
    able: &[Candidate],
    (accepted, before, causes): (&Point, &[PieceResidual], &[Cause]),
    groups: &[Vec<&Member>],
) -> Result<Option<Extended>, DiagnosisError> {
    let campaign = judged.setting.campaign;
    if !campaign.holds_out() {
        return Ok(None);
    }
    let begin = beside_what_is_uncertain(judged, able, accepted);
    let bare = beside_what_is_uncertain(judged, able, &without_causes(accepted));
    let Some(found) = beside_or_instead(judged, (begin, bare), before)? else { return Ok(None) };
    let Searched { begin, without_laws, bare, kept } = found;
    let by_time = kept.laws.terms.iter().any(goes_by_time);
    let once = if by_time { passed_once(campaign) } else { Vec::new() };
    for group in groups {
        // What goes by a condition goes by the time as well where that is passed through once: no law by the time decides it.
        if group.iter().any(|of| once.iter().any(|condition| goes_by(of.candidate.id, condition))) {
            return Ok(None);
        }
        let stays = || stays(&judged.setting, (&begin, &without_laws), group, &kept.laws);
        if campaign.with_reserve(stays)? {
            return Ok(None);
        }
    }
    let concluded = || {
        let kept = punctual(judged, &bare, kept)?;
        told(judged, (accepted, before), without_stand_ins(judged, &bare, causes, kept)?)
    };
    campaign.with_reserve(concluded).map(Some)
}

/// Whether laws in place of all selected causes leave no more than noise: what the causes leave is then their wrong form, and no error of
/// the whole model.
pub(crate) fn laws_leave_noise(judged: &Judgement<'_>, able: &[Candidate]) -> Result<bool, DiagnosisError> {
    if !judged.setting.campaign.holds_out() || judged.setting.workers.is_over() {
        return Ok(false);
    }
    let selected = without_causes(&judged.selection.fitted.point);
    alone_leave_noise(judged, beside_what_is_uncertain(judged, able, &selected))
}

/// The accepted causes with everything that may be off without being a law: every correction that the tolerance allows, and, in a log
/// with a transducer, its lateness.
fn beside_what_is_uncertain(judged: &Judgement<'_>, able: &[Candidate], accepted: &Point) -> Point {
    let own = &accepted.hypothesis;
    let is_there = |id| own.corrections.iter().any(|of| of.id == id) || own.has(id);
    let more = judged.corrections.iter().filter(|of| !is_there(of.id)).cloned();
    let corrections = own.corrections.iter().cloned().chain(more).collect();
    let late = if is_there(EffectId::SensorDelay) { None } else { lateness(judged, able) };
    let members = own.members.iter().cloned().chain(late).collect();
    Point { hypothesis: Hypothesis { members, corrections, ..own.clone() }, starts: accepted.starts.clone() }
}

/// The point without causes, every correction free: causes make up for those that they were found without. A transducer's lateness is none
/// here: it is uncertain whatever is found.
fn without_causes(point: &Point) -> Point {
    let mut bare = point.clone();
    bare.hypothesis.corrections.iter_mut().for_each(|of| of.free = true);
    bare.hypothesis.members.retain(|member| member.candidate.id == EffectId::SensorDelay);
    bare
}

/// A transducer's lateness, as the search found it if it did.
fn lateness(judged: &Judgement<'_>, able: &[Candidate]) -> Option<Member> {
    if !judged.setting.campaign.kind.motion_is_measured {
        return None;
    }
    let members = &judged.selection.fitted.point.hypothesis.members;
    let found = members.iter().find(|member| member.candidate.id == EffectId::SensorDelay).cloned();
    let candidate = able.iter().find(|candidate| candidate.id == EffectId::SensorDelay);
    found.or_else(|| candidate.map(|of| Member::new(of, of.neutral(), of.free.clone())))
}

/// The same without a lateness that is within its errors, or a lead.
fn punctual(judged: &Judgement<'_>, bare: &[PieceResidual], kept: Kept) -> Result<Kept, DiagnosisError> {
    let hypothesis = &kept.point.hypothesis;
    let own = hypothesis.members.len() - kept.laws.terms.len();
    let late = hypothesis.members.iter().take(own).position(|of| of.candidate.id == EffectId::SensorDelay);
    let Some(late) = late.filter(|_| !judged.setting.is_over()) else { return Ok(kept) };
    let place = hypothesis.place_of(Free::Number(late, 0));
    let spread = spread(&kept.laws.tried.fitted, judged.setting.loss());
    let deviation =
        place.zip(spread).map_or(f64::INFINITY, |(place, spread)| spread.deviation_given(place, &[]));
    if hypothesis.get(Free::Number(late, 0)) > CLEAR * deviation {
        return Ok(kept);
    }
    let Some(tried) = without(&judged.setting, &kept.laws.tried, late, None)? else { return Ok(kept) };
    let punctual = Kept::of(judged, bare, Laws { tried, ..kept.laws.clone() })?;
    Ok(kept.or(punctual))
}

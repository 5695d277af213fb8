//! Causes that stood in for a law: beside it they have nothing left to do.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::hypothesis::Member;
use crate::fit::equations::{Point, Setting};
use crate::measure::judgement::Judgement;
use crate::name::tried::{STEPS, Tried};
use crate::outcome::Cause;
use crate::show::residual::PieceResidual;
use crate::unnamed::kept::{Kept, MOST_LEFT};
use crate::unnamed::search::{Laws, part_cut, search, without};
use valve_model::EffectId;

/// A cause stood in for a law if beside it it cuts less than this part of the mean square that it cut without, and less than this part of
/// the mean square.
const IDLE: f64 = 0.25;
const MOST_OF_IDLE: f64 = 0.1;

/// The same without causes that the laws make idle: they stood in for them. Beside the laws such a cause cuts a small part of what it cut
/// without them.
pub(crate) fn without_stand_ins(
    judged: &Judgement<'_>,
    bare: &[PieceResidual],
    causes: &[Cause],
    kept: Kept,
) -> Result<Kept, DiagnosisError> {
    let least = kept.laws.tried.rms;
    let mut laws = kept.laws.clone();
    for place in (0..kept.point.hypothesis.members.len() - laws.terms.len()).rev() {
        let members = &laws.tried.fitted.point.hypothesis.members;
        let Some(id) = members.get(place).map(|of| of.candidate.id) else { continue };
        let Some(cause) = causes.iter().find(|cause| cause.id == id) else { continue };
        if id == EffectId::SensorDelay || judged.setting.is_over() {
            continue;
        }
        let instead = judged.corrections.iter().find(|of| of.id == id);
        let Some(tried) = without(&judged.setting, &laws.tried, place, instead)? else { continue };
        let alone = 1.0 - (1.0 - cause.rms_gain).powi(2);
        if is_idle(part_cut(&tried, least), alone) {
            laws.tried = tried;
        }
    }
    if laws.tried.fitted.point.hypothesis.members.len() == kept.point.hypothesis.members.len() {
        return Ok(kept);
    }
    let fewer = Kept::of(judged, bare, laws)?;
    Ok(kept.or(fewer))
}

/// Whether a group of causes that the data can't tell apart, its best one first, stays beside laws that were found from `begin` on: they don't make its
/// best one idle, or one of it serves as well as they do. `without_laws` is the fit of `begin`.
pub(crate) fn stays(
    setting: &Setting<'_>,
    (begin, without_laws): (&Point, &Tried),
    group: &[&Member],
    laws: &Laws,
) -> Result<bool, DiagnosisError> {
    if let Some(best) = group.first()
        && !makes_idle(setting, without_laws, &laws.tried, best)?
    {
        return Ok(true);
    }
    for cause in group {
        if serves_as_well(setting, begin, cause, laws)? {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Whether a cause that is part of neither fit has little left to do beside the laws, of what it does without them, and the laws leave
/// less than it by as much as a law must: a table over the speed can be any cause that goes by the speed.
fn makes_idle(
    setting: &Setting<'_>,
    without_laws: &Tried,
    with_laws: &Tried,
    cause: &Member,
) -> Result<bool, DiagnosisError> {
    let and_cause = |tried: &Tried| {
        if_possible(Tried::from(setting, in_place_of_its_correction(&tried.fitted.point, cause), STEPS))
    };
    let (Some(alone), Some(beside)) = (and_cause(without_laws)?, and_cause(with_laws)?) else {
        return Ok(false);
    };
    let idle = is_idle(part_cut(with_laws, beside.rms), part_cut(without_laws, alone.rms));
    Ok(idle && with_laws.rms < MOST_LEFT * alone.rms)
}

/// Whether a cause, and laws beside it that are no more than those without it, leave about as little as they do. Then it has a part in that which is its
/// own: where a level rises with pressure in one slow sweep, some law over the time and the speed follows it too.
fn serves_as_well(
    setting: &Setting<'_>,
    begin: &Point,
    cause: &Member,
    without_it: &Laws,
) -> Result<bool, DiagnosisError> {
    let instead = begin.hypothesis.corrections.iter().find(|of| of.id == cause.candidate.id);
    let place = begin.hypothesis.members.len();
    for beside in search(setting, in_place_of_its_correction(begin, cause))? {
        let no_more = beside.terms.len() <= without_it.terms.len();
        if no_more && MOST_LEFT * beside.tried.rms <= without_it.tried.rms {
            let alone = without(setting, &beside.tried, place, instead)?;
            return Ok(alone.is_some_and(|alone| part_cut(&alone, beside.tried.rms) >= MOST_OF_IDLE));
        }
    }
    Ok(false)
}

/// A point with one more cause. A number that is off by more than its tolerance takes the place of its correction.
fn in_place_of_its_correction(point: &Point, cause: &Member) -> Point {
    let others = point.hypothesis.with_corrections_of(|id| id != cause.candidate.id);
    Point { hypothesis: others.with(cause.clone()), starts: point.starts.clone() }
}

/// Whether a cause cuts little of the mean square beside laws, and little of the part that it cuts without them.
fn is_idle(beside: f64, alone: f64) -> bool {
    beside < (IDLE * alone).min(MOST_OF_IDLE)
}

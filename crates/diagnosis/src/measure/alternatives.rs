//! Every cause of a group that these data can't tell apart, fitted in place of the group's representative.

use crate::DiagnosisError;
use crate::contest::Contender;
use crate::error::if_possible;
use crate::extend::hypothesis::Member;
use crate::fit::equations::Point;
use crate::fit::gauss_newton::{Fitted, fit};
use crate::log::piece::Piece;
use crate::measure::accept::{errors_of, parameters};
use crate::measure::judgement::Judgement;
use crate::outcome::RivalFit;
use valve_model::{Effect, EffectId};

/// Steps of a fit. Few are enough, because a rival was fitted already when it was compared.
const STEPS: usize = 6;

/// A cause of a group, fitted in the representative's place.
pub(crate) struct Rival {
    pub effect: Effect,
    pub fit: RivalFit,
    /// For the next experiment; none where nothing is known of its numbers' errors.
    pub contender: Option<Contender>,
}

/// The rivals of the group that `best` represents, itself first; fewer if the search was ended early.
pub(crate) fn rivals(judged: &Judgement<'_>, best: EffectId) -> Result<Vec<Rival>, DiagnosisError> {
    let selection = &judged.selection;
    let hypothesis = &selection.fitted.point.hypothesis;
    let Some(place) = hypothesis.members.iter().position(|member| member.candidate.id == best) else {
        return Ok(Vec::new());
    };
    let mut found: Vec<Rival> = Vec::new();
    found.extend(told(judged, &selection.fitted, place)?);
    let others = selection.alternatives.iter().filter(|(of, _)| *of == best);
    for (_, member) in others.filter(|(_, member)| !hypothesis.has(member.candidate.id)) {
        if judged.setting.is_over() || found.iter().any(|of| of.fit.id == member.candidate.id) {
            continue;
        }
        if let Some(fitted) = if_possible(in_place_of(judged, place, member))? {
            found.extend(told(judged, &fitted, place)?);
        }
    }
    Ok(found)
}

/// The fit of the selected causes with another one in this place.
fn in_place_of(judged: &Judgement<'_>, place: usize, member: &Member) -> Result<Fitted, DiagnosisError> {
    let fitted = &judged.selection.fitted;
    let mut point: Point = fitted.point.clone();
    if let Some(slot) = point.hypothesis.members.get_mut(place) {
        *slot = member.clone();
    }
    point.hypothesis.corrections.retain(|of| of.id != member.candidate.id);
    fit(&judged.setting, point, &Piece::is_fitted, STEPS)
}

/// The member at this place of a fit, with its numbers and what all members leave.
pub(crate) fn told(
    judged: &Judgement<'_>,
    fitted: &Fitted,
    place: usize,
) -> Result<Option<Rival>, DiagnosisError> {
    let errors = errors_of(judged, fitted)?;
    let member = errors.hypothesis.members.get(place);
    let effect =
        member.and_then(|member| member.candidate.effect(judged.setting.given, &member.numbers).ok());
    let (Some(member), Some(effect)) = (member, effect) else { return Ok(None) };
    let (_, after) = judged.everywhere(fitted)?;
    let id = member.candidate.id;
    let fit = RivalFit {
        id,
        parameters: parameters(&errors, place),
        rms_after: judged.gain_of(&after).rms_after,
        covariance: errors.covariance(),
    };
    let contender = errors.spread.map(|spread| Contender {
        label: id.name().to_owned(),
        hypothesis: errors.hypothesis,
        covariance: spread.covariance,
    });
    Ok(Some(Rival { effect, fit, contender }))
}

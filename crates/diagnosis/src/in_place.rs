//! Zeros of each run in the place of causes: a cause that is there in few runs, or by what the runs differ in, may be no more than their zeros.

use crate::DiagnosisError;
use crate::asked::Asked;
use crate::error::if_possible;
use crate::fit::equations::{Point, Setting};
use crate::fit::spread::spread;
use crate::measure::judgement::Judgement;
use crate::measure::significance::{is_number, may_be_none};
use crate::name::selection::Selection;
use crate::name::threshold::FLOOR;
use crate::name::tried::{STEPS, Tried};
use crate::show::conditions::go_by_conditions;
use crate::show::own_zeros::zeros_hold;
use crate::zeros::{without_common_zero, zeros_by_run};
use valve_model::EffectId;

/// The selection beside zeros of each run and without the causes that are not significant there, if these zeros are plausible and leave as
/// little. A torque of the pressure that was set anew for each run is known no better than the transducer's zero from run to run is,
/// however many samples a run has.
pub(crate) fn zeros_in_place<'a>(
    judged: &Judgement<'a>,
    asked: Asked<'_>,
) -> Result<Option<(Setting<'a>, Selection)>, DiagnosisError> {
    judged.setting.campaign.with_reserve(|| in_place(judged, asked))
}

fn in_place<'a>(
    judged: &Judgement<'a>,
    asked: Asked<'_>,
) -> Result<Option<(Setting<'a>, Selection)>, DiagnosisError> {
    let Judgement { setting, selection, .. } = judged;
    let nuisances = zeros_by_run(setting, asked.corrections);
    let has_zeros = setting.nuisances.zero_nm > 0.0 || nuisances.zero_nm == 0.0;
    if has_zeros || selection.causes_of_the_valve() == 0 {
        return Ok(None);
    }
    let with_zeros = Setting { nuisances, ..*setting };
    let begin = without_common_zero(&selection.fitted.point, nuisances);
    let Some(tried) = if_possible(Tried::from(&with_zeros, begin, STEPS))? else { return Ok(None) };
    let mut fewer = selection.clone();
    fewer.take(tried);
    while let Some((index, id)) = not_beside_zeros(judged, &with_zeros, &fewer) {
        let Point { hypothesis, starts } = &fewer.fitted.point;
        let begin = Point { hypothesis: hypothesis.without(index), starts: starts.clone() };
        let Some(tried) = if_possible(Tried::from(&with_zeros, begin, STEPS))? else { return Ok(None) };
        fewer.take(tried);
        fewer.refuse(id, "it is no more than what the torque's zero differs by from run to run");
        fewer.ambiguous.retain(|(best, _)| *best != id);
    }
    let less =
        fewer.causes() < selection.causes() && fewer.rms <= selection.rms + FLOOR * selection.rms.max(1.0);
    let point = &fewer.fitted.point;
    let are_zeros = less && zeros_hold(&with_zeros, point)? && !go_by_conditions(&with_zeros, point)?;
    Ok(are_zeros.then_some((with_zeros, fewer)))
}

/// The last cause that is not significant beside zeros of each run. A parameter of the model stays: its own tolerance is judged elsewhere.
fn not_beside_zeros(
    judged: &Judgement<'_>,
    with_zeros: &Setting<'_>,
    state: &Selection,
) -> Option<(usize, EffectId)> {
    let spread = spread(&state.fitted, with_zeros.loss())?;
    let hypothesis = &state.fitted.point.hypothesis;
    let smooth = with_zeros.campaign.kind.smooth;
    let ids = hypothesis.members.iter().map(|member| member.candidate.id).enumerate();
    ids.rev().find(|(index, id)| {
        !is_number(&judged.corrections, *id) && may_be_none((hypothesis, &spread), *index, false, smooth)
    })
}

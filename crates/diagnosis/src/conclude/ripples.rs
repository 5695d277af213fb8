//! Ripples over the angle: whether their phase drifts, which are kept out of the extended model, and which remain in the residual.

use crate::DiagnosisError;
use crate::measure::accept::members_with_numbers;
use crate::measure::judgement::Judgement;
use crate::outcome::{Cause, Evidence, Offered, Parameters, RippleLeft, Verdict};
use crate::show::orders::{Ripple, ripples_by_run};
use crate::show::residual::PieceResidual;
use crate::show::ripple::{Drift, phase, times_per_turn};
use valve_model::Effect;

/// The phase of each selected ripple over the angle, by the member's index.
pub(crate) fn ripples(
    judged: &Judgement<'_>,
    left: &[PieceResidual],
    per_independent: f64,
) -> Vec<(usize, Drift)> {
    let members = judged.selection.fitted.point.hypothesis.members.iter().enumerate();
    let campaign = judged.setting.campaign;
    members
        .filter_map(|(index, member)| Some((index, phase(campaign, member, left, per_independent)?)))
        .collect()
}

pub(crate) fn drifting(ripples: &[(usize, Drift)]) -> impl Iterator<Item = usize> {
    ripples.iter().filter(|(_, of)| of.drifts).map(|(index, _)| *index)
}

pub(crate) fn tell_phases(judged: &Judgement<'_>, ripples: &[(usize, Drift)], causes: &mut [Cause]) {
    let members = &judged.selection.fitted.point.hypothesis.members;
    for (index, drift) in ripples {
        let own =
            members.get(*index).and_then(|of| causes.iter_mut().find(|cause| cause.id == of.candidate.id));
        if let Some(cause) = own {
            cause.evidence.insert("phase".to_owned(), Evidence::Text(drift.text.clone()));
        }
    }
}

/// Terms that exist but whose phase drifts: in other runs the fitted phase would be wrong.
pub(crate) fn offer(
    judged: &Judgement<'_>,
    ripples: &[(usize, Drift)],
    drifting: &[usize],
    rms_after: f64,
) -> Result<Vec<(Effect, Offered)>, DiagnosisError> {
    if drifting.is_empty() {
        return Ok(Vec::new());
    }
    let mut found = Vec::new();
    for (index, effect, parameters) in members_with_numbers(judged)? {
        let Some((_, drift)) = ripples.iter().find(|(of, _)| *of == index && drifting.contains(of)) else {
            continue;
        };
        let offered = Offered { id: effect.id(), parameters, reason: drift.text.clone(), rms_after };
        found.push((effect, offered));
    }
    Ok(found)
}

/// The sentence on a term that is kept out of the extended model.
pub(crate) fn kept_out(offered: &Offered, unit: &str) -> String {
    let orders = amplitudes(&offered.parameters);
    let orders = orders.iter().map(|(order, amplitude)| format!("order {order}: {amplitude:.3e} {unit}"));
    let others = offered.parameters.iter().filter(|(key, _)| !key.ends_with(']'));
    let others = others.map(|(key, found)| format!("{key} = {:.3e}", found.value));
    let parts: Vec<String> = orders.chain(others).collect();
    format!(
        "A {} is there ({}), but {}. It is kept out of the extended model, which has it in comments.",
        offered.id,
        parts.join(", "),
        offered.reason
    )
}

/// Ripples over the angle: those that were taken out run by run, and others in the residual after the accepted causes; empty if
/// the residual is noise.
pub(crate) fn ripples_left(
    judged: &Judgement<'_>,
    verdict: Verdict,
    after: &[PieceResidual],
) -> Vec<RippleLeft> {
    if matches!(verdict, Verdict::Explained | Verdict::NoDiscrepancy) {
        return Vec::new();
    }
    let told = |of: Ripple| RippleLeft {
        order: of.order,
        amplitude: of.amplitude,
        std_error: of.std_error,
        in_phase: of.in_phase,
    };
    let loose = judged.setting.campaign.loose_ripples.iter().map(|of| RippleLeft {
        order: of.order,
        amplitude: of.amplitude,
        std_error: of.std_error,
        in_phase: false,
    });
    loose.chain(ripples_by_run(&judged.setting, after).into_iter().map(told)).collect()
}

/// The sentence on ripples in the residual.
pub(crate) fn ripples_in_words(ripples: &[RippleLeft], unit: &str) -> Option<String> {
    if ripples.is_empty() {
        return None;
    }
    let each = |of: &RippleLeft| {
        format!(
            "{} with an amplitude of {:.2e} ± {:.1e} {unit}",
            times_per_turn(of.order),
            of.amplitude,
            of.std_error
        )
    };
    let list: Vec<String> = ripples.iter().map(each).collect();
    let phase = if ripples.iter().all(|of| of.in_phase) {
        "with the same phase in all runs"
    } else {
        "with a phase that differs from run to run, so that no function of the angle can stand for it"
    };
    Some(format!("What is left swings with the angle, {phase}: {}.", list.join(", ")))
}

/// The amplitude of each order of a series that was fitted.
fn amplitudes(parameters: &Parameters) -> Vec<(usize, f64)> {
    let part =
        |key: &str, order: usize| parameters.get(&format!("{key}[{order}]")).map_or(0.0, |found| found.value);
    let orders =
        parameters.keys().filter_map(|key| key.strip_prefix("cos[")?.strip_suffix(']')?.parse().ok());
    let mut found: Vec<(usize, f64)> =
        orders.map(|order: usize| (order, part("cos", order).hypot(part("sin", order)))).collect();
    found.sort_by_key(|(order, _)| *order);
    found
}

//! A channel with a negative delay (a lead): it is reported and offered, but not written into the extended model.
//!
//! No sensor reads ahead of time. A lead means that the channel is a command (a drive's current set-point, which is held and
//! amplified before it acts) or that two clocks differ. Both are properties of the record, which the next one may not share.

use crate::DiagnosisError;
use crate::measure::accept::members_with_numbers;
use crate::measure::judgement::Judgement;
use crate::outcome::Offered;
use valve_model::Effect;

/// The leads with their parameters.
pub(crate) fn offer_leads(
    judged: &Judgement<'_>,
    leading: &[usize],
    rms_after: f64,
) -> Result<Vec<(Effect, Offered)>, DiagnosisError> {
    if leading.is_empty() {
        return Ok(Vec::new());
    }
    let channel = judged.setting.campaign.kind.channel.name();
    let reason = format!(
        "no sensor is early: the {channel} is a command that acts later, or two clocks differ, and in another record they may not"
    );
    let all = members_with_numbers(judged)?.into_iter().filter(|(index, _, _)| leading.contains(index));
    let offered = all.map(|(_, effect, parameters)| {
        let offered = Offered { id: effect.id(), parameters, reason: reason.clone(), rms_after };
        (effect, offered)
    });
    Ok(offered.collect())
}

//! Rivals of an ambiguous group, once all causes are found: those that leave clearly more than noise are told apart from one that doesn't.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::hypothesis::{Correction, Member};
use crate::fit::equations::Setting;
use crate::name::exchange::in_place_of;
use crate::name::rivals::AT_NOISE;
use crate::name::selection::Selection;
use valve_model::EffectId;

/// A rival that leaves this much more, in noise RMS, is another cause, though data are missing that would tell the two apart in any model:
/// of 1,000 independent samples a ratio of likelihoods of exp(100).
pub(crate) const CLEARLY_MORE: f64 = 0.1;

/// Removes from each group what leaves clearly more than its best, where all causes together leave no more than noise. When a cause was
/// accepted others were missing still, and made up a difference, or hid one.
pub(crate) fn tell_apart(
    setting: &Setting<'_>,
    selection: &mut Selection,
    corrections: &[Correction],
) -> Result<(), DiagnosisError> {
    if selection.rms > AT_NOISE || setting.campaign.has_misfit {
        return Ok(());
    }
    let pairs: Vec<(EffectId, Member)> = selection.alternatives.clone();
    for (best, member) in pairs {
        if setting.is_over() {
            break;
        }
        let id = member.candidate.id;
        let in_group = selection.ambiguous.iter().any(|(of, others)| *of == best && others.contains(&id));
        if !in_group || selection.fitted.point.hypothesis.has(id) {
            continue;
        }
        let point = &selection.fitted.point;
        let tried = if_possible(in_place_of(setting, (point, corrections), (best, &member)))?.flatten();
        if tried.is_some_and(|tried| tried.rms > selection.rms + CLEARLY_MORE) {
            selection.refuse(id, &format!("explains less than {best} beside the other causes"));
            selection
                .ambiguous
                .iter_mut()
                .filter(|(of, _)| *of == best)
                .for_each(|(_, others)| others.retain(|other| *other != id));
        }
    }
    selection.ambiguous.retain(|(_, others)| !others.is_empty());
    Ok(())
}

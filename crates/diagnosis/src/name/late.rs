//! A simple cause together with a late transducer, in place of an open form that stands in for both.
//!
//! A form of many numbers, presliding-hysteresis above all, bends to what a late transducer does to a simple cause: each alone leaves more
//! than it. Only together are they seen to leave no more, with fewer numbers.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::catalogue::candidate;
use crate::extend::hypothesis::Member;
use crate::fit::equations::{Point, Setting};
use crate::name::rivals::{Rival, as_good, numbers};
use crate::name::tried::{STEPS, Tried};
use valve_model::EffectId;

/// So many simple rivals, by the error that they leave alone, are tried.
const MOST: usize = 3;

/// The best of the simpler rivals with a late transducer beside it, if that is as good as the `chosen` one; the transducer stands before
/// the cause.
pub(crate) fn with_late_transducer(
    setting: &Setting<'_>,
    chosen: &Rival,
    rivals: &[Rival],
) -> Result<Option<Rival>, DiagnosisError> {
    let campaign = setting.campaign;
    let known = chosen.fitted.point.hypothesis.has(EffectId::SensorDelay);
    if known || !campaign.kind.residual_is_torque() {
        return Ok(None);
    }
    let Some(late) = candidate(EffectId::SensorDelay, &campaign.facts) else { return Ok(None) };
    let late = Member::new(&late, late.neutral(), late.free.clone());
    let simpler = |rival: &&Rival| numbers(rival) + late.free.len() < numbers(chosen);
    let mut found: Option<Rival> = None;
    for rival in rivals.iter().filter(simpler).filter(|of| of.id != EffectId::SensorDelay).take(MOST) {
        if setting.is_over() {
            break;
        }
        let Point { hypothesis, starts } = &rival.fitted.point;
        let mut hypothesis = hypothesis.with_uncorrected(late.clone());
        // The cause stays last: it is the round's.
        if let Some(last) = hypothesis.members.len().checked_sub(1).filter(|last| *last > 0) {
            hypothesis.members.swap(last - 1, last);
        }
        let begin = Point { hypothesis, starts: starts.clone() };
        let Some(tried) = if_possible(Tried::from(setting, begin, STEPS))? else { continue };
        let together = Rival::of(rival.id, tried);
        let least = found.as_ref().map_or(f64::INFINITY, |found| found.rms);
        if as_good(chosen, &together) && together.rms < least {
            found = Some(together);
        }
    }
    Ok(found)
}

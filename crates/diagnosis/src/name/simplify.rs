//! A cause that, once the others are in, does no more than a simpler one gives way to it.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::Member;
use crate::fit::equations::{Point, Setting};
use crate::name::selection::Selection;
use crate::name::tried::{EQUAL, Tried};
use valve_model::EffectId;

/// A cause, and the one with fewer numbers that it becomes at a limit: wear over no distance, a rest of no time. While
/// another cause is still missing, the number that the simpler one doesn't have picks up some of that.
const LIMITS: [(EffectId, EffectId); 2] =
    [(EffectId::WearDrift, EffectId::CoulombLevel), (EffectId::DwellStiction, EffectId::StaticLevel)];

/// Replaces causes by their limits where these are as good on what they were not fitted on.
pub(crate) fn simplify(
    setting: &Setting<'_>,
    candidates: &[Candidate],
    state: &mut Selection,
) -> Result<(), DiagnosisError> {
    for (rich, simple) in LIMITS {
        let hypothesis = &state.fitted.point.hypothesis;
        let index = hypothesis.members.iter().position(|member| member.candidate.id == rich);
        let candidate = candidates.iter().find(|candidate| candidate.id == simple);
        let (Some(index), Some(candidate)) = (index, candidate) else { continue };
        if hypothesis.has(simple) {
            continue;
        }
        let member = Member::new(candidate, candidate.neutral(), candidate.free.clone());
        let begin = Point {
            hypothesis: hypothesis.without(index).with(member),
            starts: state.fitted.point.starts.clone(),
        };
        let Some(tried) = if_possible(Tried::from(setting, begin, 8))? else { continue };
        if tried.rms <= state.rms + EQUAL {
            state.dropped.push((rich, format!("{simple} does as much with fewer numbers")));
            state.ambiguous.retain(|(representative, _)| *representative != rich);
            state.take(tried);
        }
    }
    Ok(())
}

//! Replaces a cause by its simpler limiting case if that has the same held-out error.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::candidate::Candidate;
use crate::extend::hypothesis::Member;
use crate::fit::equations::{Point, Setting};
use crate::name::selection::Selection;
use crate::name::tried::{EQUAL, Tried};
use valve_model::EffectId;

/// A cause and its limiting case with fewer numbers: wear over zero distance, stiction after zero rest. While another cause is
/// still missing, the extra number may fit part of that one.
const LIMITS: [(EffectId, EffectId); 2] =
    [(EffectId::WearDrift, EffectId::CoulombLevel), (EffectId::DwellStiction, EffectId::StaticLevel)];

/// Replaces causes by their limiting cases where the held-out error stays the same.
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
        if hypothesis.has(simple) || setting.is_over() {
            continue;
        }
        // From what the cause does in the end: from the model's own number a fit may stop on the way.
        let gain = hypothesis.members.get(index).and_then(|member| member.numbers.first());
        let bounds = candidate.parameters.first().map(|of| (of.lower, of.upper));
        let factor = gain.zip(bounds).map(|(gain, (lower, upper))| (1.0 + gain).clamp(lower, upper));
        let numbers = factor.map_or_else(|| candidate.neutral(), |factor| vec![factor]);
        let member = Member::new(candidate, numbers, candidate.free.clone());
        let begin = Point {
            hypothesis: hypothesis.without(index).with_uncorrected(member),
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

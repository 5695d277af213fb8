//! Replaces a cause by its simpler limiting case if that has the same held-out error.

use crate::DiagnosisError;
use crate::error::if_possible;
use crate::extend::candidate::{Candidate, Map};
use crate::extend::hypothesis::Member;
use crate::fit::equations::{Point, Setting};
use crate::name::apart::CLEARLY_MORE;
use crate::name::selection::Selection;
use crate::name::tried::{EQUAL, Tried};
use valve_model::EffectId;

/// A cause and its limiting case with fewer numbers: wear over zero distance, stiction after zero rest. While another cause is
/// still missing, the extra number may fit part of that one.
const LIMITS: [(EffectId, EffectId); 2] =
    [(EffectId::WearDrift, EffectId::CoulombLevel), (EffectId::DwellStiction, EffectId::StaticLevel)];

/// The number of a cause that goes to nothing in its limit, and so many times its least value from which on it is no limit.
const EXTENT: usize = 1;
const AT_LIMIT: f64 = 3.0;

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
        let most = if hypothesis.members.get(index).is_some_and(is_at_limit) { CLEARLY_MORE } else { EQUAL };
        let Some(tried) = if_possible(Tried::from(setting, begin, 8))? else { continue };
        if tried.rms <= state.rms + most {
            state.dropped.push((rich, format!("{simple} does as much with fewer numbers")));
            state.ambiguous.retain(|(representative, _)| *representative != rich);
            state.take(tried);
        }
    }
    Ok(())
}

/// Whether the cause's extent (a time constant, a distance) is about the least that it may be: it is over before anything else has changed, and
/// what sets it apart from its limiting case is what the friction's form leaves.
fn is_at_limit(member: &Member) -> bool {
    let extent = member.candidate.parameters.get(EXTENT).zip(member.numbers.get(EXTENT));
    extent.is_some_and(|(of, value)| of.map == Map::Exp && *value < of.lower + AT_LIMIT.ln())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extend::catalogue::candidates;
    use crate::fixtures::model;
    use crate::log::facts::Facts;
    use crate::log::kind::LogKind;
    use log_data::Channel;

    #[test]
    fn a_cause_is_at_its_limit_near_the_least_extent() {
        let model = model(Vec::new());
        let facts =
            Facts { longest_rest_s: 1.0, ..Facts::of_model(&model, LogKind::predicting(Channel::Torque)) };
        let (able, _) = candidates(&facts, &model, &[], &[]);
        let dwell = able.iter().find(|of| of.id == EffectId::DwellStiction).unwrap();
        for (time_s, expected) in [(1e-3f64, true), (2e-3, true), (5e-3, false), (0.1, false)] {
            let member = Member::new(dwell, vec![0.5, time_s.ln(), 1.0], dwell.free.clone());
            assert_eq!(is_at_limit(&member), expected, "{time_s} s");
        }
    }
}

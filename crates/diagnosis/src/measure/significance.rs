//! Whether a cause's amplitudes are more than their errors, all of them together.

use crate::extend::candidate::Map;
use crate::extend::hypothesis::{Correction, Free, Hypothesis};
use crate::extend::tolerance::is_held;
use crate::fit::spread::Spread;
use crate::numerics::gram::invert;
use nalgebra::DVector;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use valve_model::EffectId;

/// By chance any cause of those that a search tries may seem to be there in one log of twenty; some twenty are tried (Bonferroni's bound).
const CHANCE_OF_ANY: f64 = 0.05 / 20.0;

/// Factors in which the torque is linear.
const IN_PROPORTION: [EffectId; 4] =
    [EffectId::CoulombLevel, EffectId::ViscousLevel, EffectId::LoadInertia, EffectId::TorqueGain];

/// Whether a cause is a parameter of the model, which has a tolerance.
pub(crate) fn is_number(corrections: &[Correction], id: EffectId) -> bool {
    corrections.iter().any(|correction| correction.id == id)
}

/// True if the linear amplitudes of a member (torques and levels of a torque log, harmonics), or a parameter of the model, are together no further
/// from zero effect than a cause that isn't there is by chance: Hotelling's test, for a covariance of so few groups. Other numbers may have wide
/// intervals however large the effect is.
///
/// The test is conditional on the member's fitted shape (exponent, time constant). Whether an effect exists is another
/// question than how it is divided between an amplitude and a shape that compensate each other.
pub(crate) fn may_be_none(
    (hypothesis, spread): (&Hypothesis, &Spread),
    index: usize,
    is_number: bool,
    smooth: bool,
) -> bool {
    let Some(member) = hypothesis.members.get(index) else { return false };
    let in_proportion = smooth || member.candidate.series;
    if !in_proportion || member.candidate.id == EffectId::EncoderEccentricity {
        return false;
    }
    let own = hypothesis.free().into_iter().enumerate().filter_map(|(place, free)| match free {
        Free::Number(of, number) if of == index => Some((place, number)),
        _ => None,
    });
    let is_amplitude = |number: usize| {
        member.candidate.parameters.get(number).is_some_and(|of| {
            let is_factor = IN_PROPORTION.contains(&member.candidate.id) || is_number;
            of.map == Map::Plain && (of.neutral == 0.0 || is_factor)
        })
    };
    let (amplitudes, shape): (Vec<_>, Vec<_>) = own.partition(|(_, number)| is_amplitude(*number));
    // Numbers that no fit moves count as they were held: a cause is accepted beside them, not in their place. A parameter of the model is
    // a number as uncertain as they are, and may be in their place.
    let held = hypothesis.free().into_iter().enumerate().filter_map(|(place, free)| match free {
        Free::Correction(index) => {
            hypothesis.corrections.get(index).filter(|of| !is_number && is_held(of.id)).map(|_| place)
        }
        Free::Zero | Free::Number(..) => None,
    });
    let known: Vec<usize> = shape.iter().map(|(place, _)| *place).chain(held).collect();
    let off = |(_, number): &(usize, usize)| {
        let neutral = member.candidate.parameters.get(*number).map_or(0.0, |of| of.neutral);
        member.numbers.get(*number).map_or(0.0, |value| value - neutral)
    };
    let off = DVector::from_iterator(amplitudes.len(), amplitudes.iter().map(off));
    let places: Vec<usize> = amplitudes.into_iter().map(|(place, _)| place).collect();
    !places.is_empty() && by_chance(spread, (&places, &off), &known) >= CHANCE_OF_ANY
}

/// Whether a parameter of the model that is a member is beyond its tolerance, further than by chance.
pub(crate) fn is_beyond(
    (hypothesis, spread): (&Hypothesis, &Spread),
    index: usize,
    tolerance: &Correction,
) -> bool {
    let place = hypothesis.place_of(Free::Number(index, 0));
    let value = hypothesis.members.get(index).and_then(|member| member.numbers.first());
    place.zip(value).is_some_and(|(place, value)| {
        let beyond = DVector::from_element(1, tolerance.beyond(*value));
        by_chance(spread, (&[place], &beyond), &[]) < CHANCE_OF_ANY
    })
}

/// The probability that numbers at these places are, together, as far `off` as they are, given the numbers at `known`.
fn by_chance(spread: &Spread, (places, off): (&[usize], &DVector<f64>), known: &[usize]) -> f64 {
    let Some(inverse) = invert(spread.covariance_given(places, known)) else { return 1.0 };
    let square = off.dot(&(inverse * off));
    let count = places.len() as f64;
    let all = spread.freedom_of(places);
    let freedom = (all - count + 1.0).max(1.0);
    let ratio = square * freedom / (count * all);
    FisherSnedecor::new(count, freedom).map_or(1.0, |of| of.sf(ratio))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    /// Standard errors 1 and 0.1 that share `shared` of their product, from so many groups.
    fn spread(shared: f64, freedom: f64) -> Spread {
        let covariance = DMatrix::from_row_slice(2, 2, &[1.0, 0.1 * shared, 0.1 * shared, 0.01]);
        Spread::of(covariance, freedom)
    }

    #[test]
    fn amplitudes_count_together_and_against_what_few_groups_tell() {
        // Shared part, degrees of freedom, how far off in standard errors; the probability, (1 + 2F/ν)^(−ν/2) for two numbers.
        let table = [
            (0.0, 1e6, [2.0, 2.0], 0.0183),
            (0.0, 1e6, [4.0, 0.0], 3.35e-4),
            (0.0, 20.0, [4.0, 0.0], 3.76e-3),
            (0.0, 4.0, [4.0, 4.0], 0.0370),
            // Two that make up for each other are small together, and clear along what they share.
            (0.9, 1e6, [3.0, 3.0], 8.77e-3),
            (0.9, 1e6, [3.0, -3.0], 8.2e-40),
        ];
        for (shared, freedom, off, expected) in table {
            let off = DVector::from_row_slice(&[off[0], 0.1 * off[1]]);
            let found = by_chance(&spread(shared, freedom), (&[0, 1], &off), &[]);
            println!("{shared} {freedom} {off:?}: {found:.3e}, expected {expected:.3e}");
            assert!((found / expected).ln().abs() < 0.2, "{found} instead of {expected}");
        }
    }

    #[test]
    fn one_amplitude_is_judged_as_by_students_test() {
        let off = DVector::from_row_slice(&[2.228]);
        // The two-sided 5 % quantile of ten degrees of freedom.
        let found = by_chance(&spread(0.0, 10.0), (&[0], &off), &[]);
        assert!((found - 0.05).abs() < 1e-4, "{found}");
        // What it shares with a number that is known is no doubt about it: 0.436 of its error is left.
        let found = by_chance(&spread(0.9, 1e6), (&[0], &DVector::from_row_slice(&[2.0 * 0.436])), &[1]);
        assert!((found - 0.0455).abs() < 1e-3, "{found}");
    }
}

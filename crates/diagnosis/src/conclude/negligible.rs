//! What is left beyond noise, where it is less than the tolerance of the model's own friction.

use crate::measure::doubt::is_as_loud_as_noise;
use crate::measure::judgement::Judgement;
use crate::outcome::Dependence;
use crate::show::observe::torque;
use crate::show::structure::{Structure, counts};
use valve_model::EffectId;

/// The sentence on a residual of a torque log that is no larger than noise, but goes by something, where that part is less than the tolerance
/// of the friction's level: the model doesn't claim to be nearer. `None` where more is left, or the tolerance is not known.
pub(crate) fn negligible(judged: &Judgement<'_>, left: &Structure) -> Option<String> {
    let tolerance_nm = judged.corrections.iter().find(|of| of.id == EffectId::TorqueOffset)?.deviation;
    if !judged.setting.campaign.kind.residual_is_torque() {
        return None;
    }
    let (part_nm, of) = within_tolerance(left, judged.noise_where_it_counts(), tolerance_nm)?;
    Some(format!(
        "of what is left {} goes by {}: less than the tolerance of the model's friction, {}",
        torque(part_nm),
        of.on,
        torque(tolerance_nm)
    ))
}

/// The RMS of the largest part of a residual that goes by something, N·m, and what it goes by: if the residual is no larger than the noise, and
/// the part less than the tolerance.
fn within_tolerance(left: &Structure, noise_nm: f64, tolerance_nm: f64) -> Option<(f64, &Dependence)> {
    let counting = left.dependences.iter().filter(|of| counts(of));
    let largest = counting.max_by(|a, b| a.share.total_cmp(&b.share))?;
    let part_nm = largest.share.sqrt() * left.rms * noise_nm;
    (is_as_loud_as_noise(left) && part_nm < tolerance_nm).then_some((part_nm, largest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_told_where_it_is_within_the_tolerance_and_the_noise() {
        // Share, p-value, RMS relative to the noise of 0.1 N·m, tolerance; the part.
        for (share, p_value, rms, tolerance_nm, expected) in [
            (0.04, 1e-6, 1.0, 0.03, Some(0.02)),
            (0.04, 1e-6, 1.0, 0.01, None),
            (0.04, 1e-6, 1.5, 0.03, None),
            // By chance, or hardly any: the residual is noise as it is.
            (0.04, 0.5, 1.0, 0.03, None),
            (0.01, 1e-6, 1.0, 0.03, None),
        ] {
            let of = Dependence { on: "speed".to_owned(), as_friction: false, share, p_value };
            let left = Structure { dependences: vec![of], rms, count: 1e4, per_independent: 1.0 };
            let found = within_tolerance(&left, 0.1, tolerance_nm).map(|(part_nm, _)| part_nm);
            let same = found
                .zip(expected)
                .map_or(found == expected, |(found, expected)| (found - expected).abs() < 1e-9);
            assert!(same, "{share} {p_value} {rms} {tolerance_nm}: {found:?} instead of {expected:?}");
        }
    }
}

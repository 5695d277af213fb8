//! Rivals whose order a misfit of the model may have turned.

use crate::DiagnosisError;
use crate::fit::equations::Setting;
use crate::name::rivals::{AT_NOISE, Rival};
use crate::workers::map;

/// The largest correlation of the misfit with what two rivals differ in that is no surprise: half of what could be.
const CORRELATION: f64 = 0.5;

/// Whether the best rival may leave less than the other only because of what both leave beyond noise.
///
/// In units of the noise: were the other the true cause, it would leave the misfit alone, of mean square u. The predictions differ by a mean
/// square d. Then the best can be ahead by D only if the misfit correlates with that difference by (d + D) / (2 √(u d)).
pub(crate) fn may_be_turned(
    setting: &Setting<'_>,
    best: &Rival,
    other: &Rival,
) -> Result<bool, DiagnosisError> {
    let misfit = other.rms.powi(2) - 1.0;
    let ahead = other.rms.powi(2) - best.rms.powi(2);
    // Whatever the predictions differ by, √(D / u) is needed.
    if !setting.campaign.kind.smooth
        || best.rms < AT_NOISE
        || ahead > CORRELATION * CORRELATION * misfit
        || setting.is_over()
    {
        return Ok(false);
    }
    let apart = apart(setting, best, other)?;
    Ok(needed(misfit, apart, ahead) <= CORRELATION)
}

/// The correlation of a misfit with a difference of predictions that puts the wrong one of two ahead.
fn needed(misfit: f64, apart: f64, ahead: f64) -> f64 {
    (apart + ahead) / (2.0 * (misfit * apart).sqrt()).max(f64::MIN_POSITIVE)
}

/// The mean square by which the predictions of two rivals differ, in units of the noise.
fn apart(setting: &Setting<'_>, one: &Rival, two: &Rival) -> Result<f64, DiagnosisError> {
    let (a, b, campaign) = (&one.fitted.point, &two.fitted.point, setting.campaign);
    let (ready_a, ready_b) = (setting.ready(&a.hypothesis)?, setting.ready(&b.hypothesis)?);
    let squares = map(setting.workers, campaign.pieces.len(), |index| {
        let piece = campaign.pieces.get(index).filter(|piece| piece.is_fitted())?;
        let one = piece.predict(&ready_a, a.start(index));
        let two = piece.predict(&ready_b, b.start(index));
        let differences = one.iter().zip(&two).zip(&piece.weights);
        Some(differences.map(|((one, two), weight)| (weight * (one - two)).powi(2)).sum::<f64>())
    });
    let count: f64 = one.fitted.groups.iter().map(|group| group.count).sum();
    Ok(squares.into_iter().flatten().sum::<f64>() / count.max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A residual of a misfit, and of predictions that differ in one direction: what is needed is just what turns them.
    #[test]
    fn the_correlation_that_is_needed_turns_the_order() {
        for (misfit, apart, ahead) in [(0.2_f64, 0.02_f64, 0.01_f64), (1.0, 0.5, 0.2), (4.0, 1.0, 0.0)] {
            // The true cause leaves the misfit m alone; the other leaves m − d, which is ahead by 2 m d − d².
            let correlation = needed(misfit, apart, ahead);
            let gained = 2.0 * correlation * (misfit * apart).sqrt() - apart;
            assert!((gained - ahead).abs() < 1e-12, "{gained}, {ahead}");
        }
    }
}

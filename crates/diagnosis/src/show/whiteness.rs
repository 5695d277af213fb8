//! Tests if a residual is white, by the autocorrelation of its samples (Ljung and Box, Biometrika 65, 1978).

use crate::fit::equations::Setting;
use crate::log::piece::Piece;
use crate::numerics::statistics::CHANCE;
use crate::outcome::Whiteness;
use crate::show::residual::PieceResidual;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Lags of the reported test.
const LAGS: usize = 20;
/// Lags of the test that ends the search. A cause with 2 % of the variance of 10,000 samples exceeds the bound by ten times the
/// statistic's scatter.
const SEARCHED: usize = 64;
/// The search goes on if the statistic exceeds its mean by this many standard deviations.
const DEVIATIONS: f64 = 4.0;
/// Noise counts as white if less than this share of its variance is predictable; with many samples every test is
/// significant.
const FORETOLD: f64 = 0.02;

/// Noise below `LITTLE_NOISE` of an encoder step hardly dithers the quantisation: all but a share `RARELY` of the
/// readings then lie within `NEXT_STEP` of a step, plus three standard deviations of the noise, of a correct
/// prediction.
const LITTLE_NOISE: f64 = 0.15;
const NEXT_STEP: f64 = 0.6;
const RARELY: f64 = 0.01;

/// The reported test of the normalised residual.
pub(crate) fn whiteness(setting: &Setting<'_>, left: &[PieceResidual]) -> Whiteness {
    let (correlations, count) = correlations::<LAGS>(setting, left, |_| true);
    judged(&correlations, count)
}

/// True if the residual of the fitted pieces is white, so that no further cause is searched for.
pub(crate) fn is_white(setting: &Setting<'_>, left: &[PieceResidual]) -> bool {
    if is_rounding(setting, left) {
        return true;
    }
    let (correlations, count) = correlations::<SEARCHED>(setting, left, Piece::is_fitted);
    let lags = SEARCHED as f64;
    statistic(&correlations, count) < lags + DEVIATIONS * (2.0 * lags).sqrt()
}

/// The autocorrelations from lag 1 on, within the pieces that `counts` selects, and the number of samples.
fn correlations<const N: usize>(
    setting: &Setting<'_>,
    left: &[PieceResidual],
    counts: impl Fn(&Piece) -> bool,
) -> ([f64; N], f64) {
    let (mut square, mut sums, mut count) = (0.0, [0.0; N], 0.0);
    for (piece, left) in setting.campaign.pieces.iter().zip(left).filter(|(piece, _)| counts(piece)) {
        let values = piece.together(&left.residual);
        let product =
            |lag: usize| values.iter().zip(values.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
        count += values.iter().filter(|value| **value != 0.0).count() as f64;
        square += product(0);
        sums.iter_mut().zip(1..).for_each(|(sum, lag)| *sum += product(lag));
    }
    // Normalised by at least the noise's sum of squares: a residual below the noise counts as white however it is
    // correlated.
    (sums.map(|sum| if square > 0.0 { sum / square.max(count) } else { 0.0 }), count)
}

/// True if nearly all readings are the encoder step nearest to the prediction. A coarse encoder's quantisation error
/// is correlated with speed and angle; it is no model error.
pub(crate) fn is_rounding(setting: &Setting<'_>, left: &[PieceResidual]) -> bool {
    if setting.campaign.kind.residual_is_torque() {
        return false;
    }
    let (mut beyond, mut all) = (0, 0);
    for (piece, left) in setting.campaign.pieces.iter().zip(left) {
        let noise_rad = piece.noise.beyond_quantisation_rad();
        if noise_rad > LITTLE_NOISE * piece.noise.step_rad {
            return false;
        }
        let most_rad = NEXT_STEP * piece.noise.step_rad + 3.0 * noise_rad;
        beyond += left.residual.iter().filter(|residual| residual.abs() > most_rad).count();
        all += left.residual.len();
    }
    (beyond as f64) < RARELY * all as f64
}

/// Ljung and Box's Q.
fn statistic(correlations: &[f64], count: f64) -> f64 {
    let terms = correlations.iter().zip(1..).map(|(correlation, lag)| {
        let pairs = (count - f64::from(lag)).max(1.0);
        correlation * correlation / pairs
    });
    count * (count + 2.0) * terms.sum::<f64>()
}

fn judged(correlations: &[f64; LAGS], count: f64) -> Whiteness {
    let statistic = statistic(correlations, count);
    let p_value = ChiSquared::new(LAGS as f64).map_or(1.0, |chi| 1.0 - chi.cdf(statistic));
    let foretold = foretold(correlations);
    let white = p_value >= CHANCE || foretold < FORETOLD;
    Whiteness { lags: LAGS, statistic, p_value, foretold, white }
}

/// The share of the variance that a linear prediction from the preceding samples removes (Levinson and Durbin).
fn foretold(correlations: &[f64; LAGS]) -> f64 {
    let mut weights: Vec<f64> = Vec::with_capacity(LAGS);
    let mut left = 1.0;
    for (known, correlation) in correlations.iter().enumerate() {
        let recent = correlations.iter().take(known).rev();
        let so_far: f64 = weights.iter().zip(recent).map(|(weight, r)| weight * r).sum();
        let partial: f64 = (correlation - so_far) / left;
        if !partial.is_finite() || partial.abs() >= 1.0 {
            break;
        }
        let turned: Vec<f64> = weights.iter().rev().copied().collect();
        weights.iter_mut().zip(turned).for_each(|(weight, other)| *weight -= partial * other);
        weights.push(partial);
        left *= 1.0 - partial * partial;
    }
    1.0 - left
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_is_foretold_and_noise_is_not() {
        let mut chain = [0.0; LAGS];
        chain.iter_mut().zip(1..).for_each(|(r, lag)| *r = 0.8f64.powi(lag));
        // Of r = 0.8·r' + e the part 0.8² is predictable.
        assert!((foretold(&chain) - 0.64).abs() < 1e-9);
        assert!(!judged(&chain, 1000.0).white);
        let noise: [f64; LAGS] = std::array::from_fn(|lag| if lag % 2 == 0 { 0.02 } else { -0.02 });
        let found = judged(&noise, 1000.0);
        assert!(found.white && found.p_value > 0.5, "{found:?}");
    }
}

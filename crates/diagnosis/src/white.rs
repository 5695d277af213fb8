//! Whether a residual is white: what a cause leaves behind shows in the correlation of neighbours, whichever cause it is.
//!
//! Ljung and Box's sum of squared autocorrelations (Biometrika 65, 1978), over the lags of a window; each piece counts by
//! itself. A cause that makes two hundredths of the variance of 10,000 samples exceeds it by ten times what chance does.

use crate::linear::Setting;
use crate::measure::Left;

const LAGS: usize = 64;
/// Above the sum's mean by so many of its standard deviations a residual is not white.
const DEVIATIONS: f64 = 4.0;

/// Whether the residual of the pieces that are fitted can't be told from white noise.
pub(crate) fn is_white(setting: &Setting<'_>, left: &[Left]) -> bool {
    let mut products = vec![0.0; LAGS + 1];
    let mut count = 0.0;
    let pieces = setting.campaign.pieces.iter().zip(left).filter(|(piece, _)| !piece.hold_out);
    for (piece, left) in pieces {
        let values: Vec<f64> =
            left.residual.iter().zip(&piece.weights).map(|(value, weight)| value * weight).collect();
        count += values.len() as f64;
        for (lag, sum) in products.iter_mut().enumerate() {
            *sum += values.iter().zip(values.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
        }
    }
    let square = products.first().copied().unwrap_or(0.0);
    if square <= 0.0 {
        return true;
    }
    let sum: f64 = products.iter().skip(1).map(|product| count * (product / square).powi(2)).sum();
    let lags = LAGS as f64;
    sum < lags + DEVIATIONS * (2.0 * lags).sqrt()
}

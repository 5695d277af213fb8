//! What counts as significant, and probabilities corrected for the number of tests.

/// Significance level of p-values that are corrected for the number of tests.
pub(crate) const CHANCE: f64 = 0.01;
/// A covariate that explains less of a residual than this share does not count, however significant: with many samples every
/// test is.
pub(crate) const SHARE_LEFT: f64 = 0.02;

/// Corrects p-values for the number of tests by Holm's method (Scand. J. Stat. 6, 1979): the probability of any false rejection
/// is then at most that of a single test.
pub(crate) fn holm<'a>(p_values: impl Iterator<Item = &'a mut f64>) {
    let mut sorted: Vec<&mut f64> = p_values.collect();
    sorted.sort_by(|a, b| a.total_cmp(b));
    let (mut tests, mut least) = (sorted.len() as f64, 0.0);
    for p_value in sorted {
        least = f64::max(least, *p_value * tests).min(1.0);
        *p_value = least;
        tests -= 1.0;
    }
}

/// Values with mean 0 and standard deviation 1; `None` where they are the same throughout, or not all known.
pub(crate) fn standardised(values: &[f64]) -> Option<Vec<f64>> {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let deviation = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt();
    let varies = deviation.is_finite() && deviation > 1e-9 * mean.abs();
    varies.then(|| values.iter().map(|value| (value - mean) / deviation).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_are_corrected_one_after_the_other() {
        let mut found = [0.04, 0.01, 0.03, 0.005];
        holm(found.iter_mut());
        let expected = [0.06, 0.03, 0.06, 0.02];
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }
}

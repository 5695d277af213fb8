//! Medians and the like, which a few wild samples don't move.

/// The median of what is finite; NaN of nothing.
pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    log_data::median(&mut finite).unwrap_or(f64::NAN)
}

/// The value below which this part of what is finite lies; NaN of nothing.
pub(crate) fn quantile(values: impl Iterator<Item = f64>, part: f64) -> f64 {
    let mut finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    finite.sort_unstable_by(f64::total_cmp);
    log_data::quantile(&finite, part).unwrap_or(f64::NAN)
}

/// The standard deviation of noise from sample to sample: from the median of second differences, in which motion hardly
/// shows. (White noise of deviation 1 has second differences of deviation √6, whose median magnitude is 0.6745·√6.)
pub(crate) fn noise(values: &[f64]) -> f64 {
    let second = values.windows(3).map(|three| match three {
        [a, b, c] => (a - 2.0 * b + c).abs(),
        _ => f64::NAN,
    });
    median(second) / (0.6745 * 6f64.sqrt())
}

//! Medians and other quantiles.

/// The value in the middle, the upper one of two; `None` of no values. Reorders them.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The value at or below which this part of ascending values lies, to the nearest one; `None` of no values.
pub fn quantile<T: Copy>(ascending: &[T], part: f64) -> Option<T> {
    let last = ascending.len().checked_sub(1)?;
    ascending.get((part * last as f64).round() as usize).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantile_is_the_nearest_value() {
        let ascending = [1, 2, 3, 4];
        for (part, expected) in [(0.0, 1), (0.16, 1), (0.17, 2), (0.5, 3), (0.95, 4), (1.0, 4)] {
            assert_eq!(quantile(&ascending, part), Some(expected), "{part}");
        }
        assert_eq!(quantile::<u64>(&[], 0.5), None);
    }

    #[test]
    fn the_half_is_the_median() {
        for count in 1..9 {
            let ascending: Vec<f64> = (0..count).map(f64::from).collect();
            assert_eq!(quantile(&ascending, 0.5), median(&mut ascending.clone()), "{count}");
        }
        assert_eq!(median(&mut []), None);
    }
}

//! A low-pass without delay, for samples at even times: Butterworth of order 4, once forwards and once backwards.
//!
//! Missing samples (NaN) are bridged by straight lines while the filter runs, and are missing afterwards. Valid where the
//! sampling is even; where it isn't, the corner moves with the local interval.

use std::f64::consts::PI;

/// Quality factors of the two pairs of poles of a Butterworth filter of order 4: 1/(2 cos(π/8)), 1/(2 cos(3π/8)).
const QUALITY: [f64; 2] = [0.541_196_100_146_197, 1.306_562_964_876_376_4];

/// The samples without what lies above the corner, where the gain is 1/2 (1/√2 each way). `corner` is in parts of the
/// sampling rate, above 0 and below 1/2.
pub(crate) fn low_pass(values: &[f64], corner: f64) -> Vec<f64> {
    let mut filtered = bridged(values);
    let (Some(&first), Some(&last)) = (filtered.first(), filtered.last()) else { return filtered };
    // The ends are continued by their own reflection in the end point, until the filter has forgotten where it began.
    let reach = ((10.0 / corner).ceil() as usize).min(filtered.len() - 1);
    let before = filtered.iter().skip(1).take(reach).rev().map(|value| 2.0 * first - value);
    let after = filtered.iter().rev().skip(1).take(reach).map(|value| 2.0 * last - value);
    let mut padded: Vec<f64> = before.chain(filtered.iter().copied()).chain(after).collect();
    for _ in 0..2 {
        QUALITY.into_iter().for_each(|quality| section(&mut padded, corner, quality));
        padded.reverse();
    }
    filtered.clear();
    filtered.extend(padded.into_iter().skip(reach).take(values.len()));
    for (filtered, given) in filtered.iter_mut().zip(values) {
        if given.is_nan() {
            *filtered = f64::NAN;
        }
    }
    filtered
}

/// One section of second order by the bilinear transform, begun at rest on the first value.
fn section(values: &mut [f64], corner: f64, quality: f64) {
    let k = (PI * corner).tan();
    let norm = 1.0 / (1.0 + k / quality + k * k);
    let (b, a1, a2) = (k * k * norm, 2.0 * (k * k - 1.0) * norm, (1.0 - k / quality + k * k) * norm);
    let first = values.first().copied().unwrap_or_default();
    let (mut x, mut y) = ([first; 2], [first; 2]);
    for value in values {
        let out = b * (*value + 2.0 * x[0] + x[1]) - a1 * y[0] - a2 * y[1];
        (x, y) = ([*value, x[0]], [out, y[0]]);
        *value = out;
    }
}

/// Missing samples replaced by the straight line between their neighbours; at an end, by the nearest one.
pub(crate) fn bridged(values: &[f64]) -> Vec<f64> {
    let mut out = values.to_vec();
    let mut before: Option<(usize, f64)> = None;
    let mut gap = 0;
    for (index, &value) in values.iter().enumerate() {
        if value.is_nan() {
            gap += 1;
            continue;
        }
        if gap > 0 {
            let (from, start) = before.unwrap_or((index - gap, value));
            let slope = (value - start) / (index - from).max(1) as f64;
            for (place, slot) in out.iter_mut().enumerate().take(index).skip(index - gap) {
                *slot = start + slope * place.saturating_sub(from) as f64;
            }
        }
        (before, gap) = (Some((index, value)), 0);
    }
    if let Some((last, value)) = before {
        out.iter_mut().skip(last + 1).for_each(|slot| *slot = value);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn half_is_left_at_the_corner_all_below_nothing_above_and_no_delay() {
        for (part, gain, within) in [(0.005, 1.0, 1e-3), (0.05, 0.5, 0.01), (0.25, 0.0, 1e-3)] {
            let tone = |k: usize| (TAU * part * k as f64).sin();
            let filtered = low_pass(&(0..4000).map(tone).collect::<Vec<_>>(), 0.05);
            for (k, filtered) in filtered.iter().enumerate().take(3000).skip(1000) {
                assert!((filtered - gain * tone(k)).abs() < within, "{part}: sample {k}");
            }
        }
    }

    #[test]
    fn missing_samples_are_bridged_and_stay_missing() {
        let gap = f64::NAN;
        assert_eq!(bridged(&[gap, 1.0, gap, gap, 4.0, gap]), [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        let line: Vec<f64> = (0..100).map(|k| if k % 7 == 3 { gap } else { f64::from(k) }).collect();
        let filtered = low_pass(&line, 0.1);
        for (k, (given, filtered)) in line.iter().zip(&filtered).enumerate() {
            assert!(given.is_nan() == filtered.is_nan(), "sample {k}");
            assert!(given.is_nan() || (given - filtered).abs() < 1e-6, "sample {k}: {filtered}");
        }
        assert!(low_pass(&[gap, gap], 0.1).iter().all(|value| value.is_nan()));
    }
}

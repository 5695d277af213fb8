//! The filter behind published scores of measured records: a zero-phase Butterworth low-pass.

use std::f64::consts::PI;

/// Butterworth's low-pass of order 4 at a tenth of the sampling rate, forwards and backwards; the ends are reflected.
pub fn there_and_back(values: &[f64]) -> Vec<f64> {
    const PAD: usize = 100;
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return Vec::new() };
    let before = values.iter().skip(1).take(PAD).rev().map(|value| 2.0 * first - value);
    let after = values.iter().rev().skip(1).take(PAD).map(|value| 2.0 * last - value);
    let mut padded: Vec<f64> = before.chain(values.iter().copied()).chain(after).collect();
    for _ in 0..2 {
        // The quality factors of the two pairs of poles.
        for quality in [0.541_196_100_146_197, 1.306_562_964_876_376_4] {
            padded = low_pass(&padded, 0.1, quality);
        }
        padded.reverse();
    }
    padded.into_iter().skip(PAD).take(values.len()).collect()
}

/// A second-order low-pass by the bilinear transform, at a part of the sampling rate; it begins at rest on the first value.
fn low_pass(values: &[f64], part: f64, quality: f64) -> Vec<f64> {
    let k = (PI * part).tan();
    let norm = 1.0 / (1.0 + k / quality + k * k);
    let (b, a1, a2) = (k * k * norm, 2.0 * (k * k - 1.0) * norm, (1.0 - k / quality + k * k) * norm);
    let first = values.first().copied().unwrap_or(0.0);
    let ((mut x1, mut x2), (mut y1, mut y2)) = ((first, first), (first, first));
    let filter = |value: &f64| {
        let out = b * (value + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
        (x2, x1) = (x1, *value);
        (y2, y1) = (y1, out);
        out
    };
    values.iter().map(filter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_signals_pass_without_delay_and_fast_ones_do_not() {
        let wave =
            |part: f64| -> Vec<f64> { (0..2000).map(|k| (2.0 * PI * part * f64::from(k)).sin()).collect() };
        let largest = |values: &[f64]| {
            values.iter().skip(200).take(1600).fold(0.0, |most: f64, value| most.max(value.abs()))
        };
        let slow = wave(0.01);
        let off: Vec<f64> = there_and_back(&slow).iter().zip(&slow).map(|(out, value)| out - value).collect();
        assert!(largest(&off) < 1e-3, "{}", largest(&off));
        assert!(largest(&there_and_back(&wave(0.3))) < 1e-3);
        // At the corner either pass leaves 1/√2 of the amplitude.
        let corner = largest(&there_and_back(&wave(0.1))) / largest(&wave(0.1));
        assert!((corner - 0.5).abs() < 0.01, "{corner}");
    }
}

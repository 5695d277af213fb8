//! Numbers as text for the page: base64 of little-endian arrays, half the size of decimals and exact.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Float64 array.
pub(crate) fn float64(values: impl IntoIterator<Item = f64>) -> String {
    STANDARD.encode(values.into_iter().flat_map(f64::to_le_bytes).collect::<Vec<u8>>())
}

/// Float32 array.
pub(crate) fn float32(values: impl IntoIterator<Item = f32>) -> String {
    STANDARD.encode(values.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
}

/// The middle of the finite values: subtracted before they become Float32, so that the rounding is 2^-25 of the
/// signal's span, whatever its level. 0 where nothing is finite.
pub(crate) fn middle(values: &[f64]) -> f64 {
    let (low, high) = span(values.iter().copied());
    if low <= high { low + (high - low) / 2.0 } else { 0.0 }
}

/// Smallest and largest finite value; (inf, -inf) where nothing is finite.
pub(crate) fn span(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

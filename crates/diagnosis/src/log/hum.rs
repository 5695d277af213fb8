//! Tones of the mains that were found in the measured channel.

/// A tone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hum {
    pub hz: f64,
    /// Its root-mean-square amplitude, in the channel's unit.
    pub amplitude: f64,
}

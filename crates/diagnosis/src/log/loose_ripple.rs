//! Ripples over the angle whose phase each run has for itself: its angle begins anywhere, or the phase drifts.

/// A ripple that was taken out of the measured channel, run by run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LooseRipple {
    /// Periods in a turn.
    pub order: usize,
    /// Root of the mean square over runs of its amplitude, in the channel's unit.
    pub amplitude: f64,
    /// Its standard error.
    pub std_error: f64,
}

//! Ripples over the angle whose phase differs from run to run: the runs have no common zero, or the phase drifts.

/// A ripple that was taken out of the measured channel, run by run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LooseRipple {
    /// Periods in a turn.
    pub order: usize,
    /// The root mean square over runs of its amplitude, in the channel's unit.
    pub amplitude: f64,
    /// Its standard error.
    pub std_error: f64,
}

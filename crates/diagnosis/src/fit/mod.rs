//! Fitting a hypothesis to the log: its normal equations, the loss, the starts of the pieces, and how well the numbers are known.

pub(crate) mod equations;
pub(crate) mod gauss_newton;
pub(crate) mod kept;
pub(crate) mod pattern;
pub(crate) mod spread;
pub(crate) mod start;

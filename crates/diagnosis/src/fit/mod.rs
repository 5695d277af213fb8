//! Fitting a hypothesis to the log: its normal equations, the initial states of the pieces, and the numbers' covariance.

pub(crate) mod equations;
pub(crate) mod gauss_newton;
pub(crate) mod kept;
pub(crate) mod law_column;
pub(crate) mod pattern;
pub(crate) mod spread;
pub(crate) mod start;

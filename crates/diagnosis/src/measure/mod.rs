//! The gain of the accepted causes in held-out error, with their parameters and intervals.

pub(crate) mod accept;
pub(crate) mod alternatives;
pub(crate) mod covariates;
pub(crate) mod doubt;
pub(crate) mod gain;
pub(crate) mod judgement;
pub(crate) mod significance;

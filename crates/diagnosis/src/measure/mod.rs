//! What the accepted causes are worth on held-out runs, with their numbers and intervals.

pub(crate) mod accept;
pub(crate) mod alternatives;
pub(crate) mod covariates;
pub(crate) mod doubt;
pub(crate) mod gain;
pub(crate) mod judgement;

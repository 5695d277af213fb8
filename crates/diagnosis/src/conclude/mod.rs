//! From the accepted causes to the verdict, the reasons for the others, and the next experiment.

pub(crate) mod leads;
pub(crate) mod negligible;
pub(crate) mod next_experiment;
pub(crate) mod reasons;
pub(crate) mod ripples;
pub(crate) mod verdict;

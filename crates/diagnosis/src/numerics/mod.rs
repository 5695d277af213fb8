//! Linear algebra and statistics that know nothing of valves.

pub(crate) mod gram;
pub(crate) mod line;
pub(crate) mod loss;
pub(crate) mod statistics;

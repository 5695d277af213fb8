//! Whether the belief fits the valve: which share of friction and inertia it has, whether the loop oscillates, whether compensation does
//! harm, and the alarms that follow.

pub(crate) mod alarms;
pub(crate) mod benefit;
pub(crate) mod load_share;
pub(crate) mod oscillation;

//! Set-point to jerk-limited Reference.
//!
//! Once per cycle k [`step`] gives Reference k+2: where the valve shall be at t_k+2, from the set-points so far,
//! within the limits of motion. Angles, openings and flows are reached by time-optimal motions (rsruckig), planned
//! anew from the reference's present state whenever a set-point or a held flow's pressure asks for it; rotation
//! and sine go on without an end. Pure: no clock, no heap.
#![forbid(unsafe_code)]

mod accept;
mod feasible;
mod motion;
mod params;
mod planner;
mod profile;
mod sine;
mod state;
mod step;
mod target;
mod time_scale;

pub use feasible::feasible;
pub use params::{Limits, Params, TrajectoryError};
pub use state::State;
pub use step::{Input, step};

//! How a valve is homed: the mark that is looked for, and the limits of the search.

use serde::{Deserialize, Serialize};

/// What the valve is homed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum HomingMethod {
    /// A switch that is on beyond its angle.
    Switch,
    /// A hard stop, met at reduced current; needs an encoder.
    Stop,
    /// The encoder's index, once a turn.
    Index,
    /// An absolute encoder whose offset is stored: only the teeth are aligned.
    Absolute,
}

/// How to home.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Homing {
    /// The mark that is searched for.
    pub method: HomingMethod,
    /// Speed of the search, rad/s; its sign is the direction.
    pub speed_rad_per_s: f64,
    /// Angle of the mark, rad.
    pub angle_rad: f64,
    /// The longest travel of the search, rad.
    pub longest_rad: f64,
    /// The part of the rated current on the way to a hard stop.
    pub stop_current: f64,
    /// How far the rests of the alignment may lie from their mean, rad.
    pub largest_spread_rad: f64,
}

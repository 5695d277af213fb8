//! What a contact remembers beyond its law: how long it has rested, how far it has slipped, the lagging speed.

use super::lag::Lagging;
use serde::{Deserialize, Serialize};

/// The contact's past.
///
/// The time at rest grows with time and falls with slip, dt_rest/dt = 1 − |slip rate|·t_rest/D over a slip length D of
/// the order of the break-away deflection: presliding leaves it, sliding ends it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Contact {
    /// The speed at which the steady curve is read where friction lags, rad/s, ...
    pub curve_speed: f64,
    /// ... and the one between two stages of the lag.
    pub stage_speed: f64,
    /// Time at rest, s.
    pub rest_s: f64,
    /// Distance travelled, rad.
    pub distance_rad: f64,
    /// The clock, s.
    pub clock_s: f64,
}

impl Contact {
    /// What lags.
    pub fn lagging(&self) -> Lagging {
        Lagging { stage: self.stage_speed, curve: self.curve_speed }
    }

    /// Takes `dt_s` in which the shaft turned by `turn_rad` and slipped by `slip_rad`, over a slip length of `length_rad`.
    pub fn travel(&mut self, turn_rad: f64, slip_rad: f64, length_rad: f64, dt_s: f64) {
        self.distance_rad += turn_rad.abs();
        let lengths = slip_rad.abs() / length_rad;
        let kept = (-lengths).exp();
        let gained = if lengths > 1e-9 { (1.0 - kept) / lengths } else { 1.0 };
        self.rest_s = self.rest_s * kept + dt_s * gained;
    }
}

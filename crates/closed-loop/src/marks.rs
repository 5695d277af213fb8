//! What homing meets on the simulated valve: a switch, the encoder's index, hard stops.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use valve_model::ValveState;

/// The marks, at true angles; those that are `None` don't exist.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Marks {
    /// Angle from which on the switch is on, rad.
    pub switch_rad: Option<f64>,
    /// Whether it is on towards negative angles.
    pub switch_below: bool,
    /// The encoder's index, once a turn, rad.
    pub index_rad: Option<f64>,
    /// A hard stop below, rad.
    pub low_stop_rad: Option<f64>,
    /// A hard stop above, rad.
    pub high_stop_rad: Option<f64>,
}

impl Marks {
    /// Whether the switch is on.
    pub(crate) fn switch_is_on(&self, angle_rad: f64) -> bool {
        self.switch_rad.is_some_and(|at| if self.switch_below { angle_rad <= at } else { angle_rad >= at })
    }

    /// Where the index was passed on the way between two angles, rad.
    pub(crate) fn index_passed(&self, from_rad: f64, to_rad: f64) -> Option<f64> {
        let index_rad = self.index_rad?;
        let turn = |angle_rad: f64| ((angle_rad - index_rad) / TAU).floor();
        let (from, to) = (turn(from_rad), turn(to_rad));
        (from != to).then(|| index_rad + TAU * from.max(to))
    }

    /// Keeps the valve between its stops: it hits them without a rebound.
    pub(crate) fn stop(&self, valve: &mut ValveState) {
        let low = self.low_stop_rad.filter(|low| valve.angle_rad < *low);
        if let Some(stop_rad) = low.or(self.high_stop_rad.filter(|high| valve.angle_rad > *high)) {
            let twist_rad = valve.rotor_angle_rad - valve.angle_rad;
            valve.angle_rad = stop_rad;
            valve.rotor_angle_rad = stop_rad + twist_rad;
            valve.encoder_shaft_rad = valve.rotor_angle_rad;
            (valve.speed_rad_per_s, valve.rotor_speed_rad_per_s) = (0.0, 0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_is_passed_once_a_turn_in_either_direction() {
        let marks = Marks { index_rad: Some(1.0), ..Marks::default() };
        assert_eq!(marks.index_passed(0.9, 1.1), Some(1.0));
        assert_eq!(marks.index_passed(1.1, 0.9), Some(1.0));
        assert_eq!(marks.index_passed(0.9 + TAU, 1.1 + TAU), Some(1.0 + TAU));
        assert_eq!(marks.index_passed(0.9 - TAU, 1.1 - TAU), Some(1.0 - TAU));
        assert_eq!(marks.index_passed(1.1, 1.0 + 0.9 * TAU), None);
    }
}

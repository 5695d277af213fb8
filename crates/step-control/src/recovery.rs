//! Lost steps, seen from the load angle.
//!
//! Beyond 180° of electrical lag the motor pulls into the next tooth: the command is then whole tooth pitches away from the
//! angle that it holds. Re-synchronising accepts these teeth as lost.

use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Electrical lag, rad: beyond `DOUBTFUL_RAD` steps are lost if the lag still grows, beyond `CERTAIN_RAD` at once.
/// Both lie within the tooth pitch after 180°.
const DOUBTFUL_RAD: f64 = PI + 0.6;
const CERTAIN_RAD: f64 = 1.5 * PI;

/// Position of the command relative to the rotor.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Recovery {
    /// Tooth pitches between the command and the angle that it holds.
    pub teeth: i64,
    /// Tooth pitches lost since arming, in whatever direction.
    pub lost_teeth: u64,
    /// The lag of the reading before, lost teeth aside, electrical rad.
    before_rad: f64,
}

impl Recovery {
    /// Begins with the rotor in the tooth that follows from a lag (electrical, rad).
    pub(crate) fn begin(electrical_lag_rad: f64) -> Self {
        Self { teeth: (electrical_lag_rad / TAU).round() as i64, ..Self::default() }
    }

    /// Whether steps have been lost, given the lag (electrical, rad) of a new reading.
    pub(crate) fn lost(&mut self, electrical_lag_rad: f64) -> bool {
        let lag_rad = (electrical_lag_rad - TAU * self.teeth as f64).abs();
        let going = self.before_rad > DOUBTFUL_RAD && lag_rad > self.before_rad;
        self.before_rad = lag_rad;
        lag_rad > CERTAIN_RAD || going
    }

    /// Accepts the rotor's position that follows from this lag.
    pub(crate) fn resynchronise(&mut self, electrical_lag_rad: f64) {
        let teeth = (electrical_lag_rad / TAU).round() as i64;
        self.lost_teeth = self.lost_teeth.saturating_add(teeth.abs_diff(self.teeth));
        self.teeth = teeth;
        self.before_rad = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotor_that_swings_back_has_lost_nothing() {
        let mut recovery = Recovery::default();
        assert!(!recovery.lost(PI + 0.7));
        assert!(!recovery.lost(PI - 0.3));
        assert!(!recovery.lost(PI + 0.9));
        assert!(!recovery.lost(PI + 0.8));
        assert!(recovery.lost(PI + 1.0));
        assert!(recovery.lost(CERTAIN_RAD + 0.1));
    }

    #[test]
    fn lost_teeth_are_counted_in_either_direction() {
        let mut recovery = Recovery::begin(0.2);
        recovery.resynchronise(2.0 * TAU + 0.3);
        recovery.resynchronise(TAU);
        assert_eq!((recovery.teeth, recovery.lost_teeth), (1, 3));
    }
}

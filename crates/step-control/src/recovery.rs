//! Lost steps: seen from the load angle, and how the command finds back to the rotor without a jerk.
//!
//! Beyond 180° of electrical lag the motor pulls into the next tooth: the command is then whole tooth pitches away from
//! the angle that it holds. Re-synchronising takes these teeth for granted, lets the target begin where the rotor is, at
//! the rotor's speed, and brings it back to the reference as a critically damped spring would.

use signals::Reference;
use std::f64::consts::{PI, TAU};

/// Lag beyond 180°, electrical rad, from where a rotor that goes on does not come back; and the one that is sure at once.
/// Both lie within the tooth pitch after 180°.
const DOUBTFUL_RAD: f64 = PI + 0.6;
const CERTAIN_RAD: f64 = 1.5 * PI;

/// Rate of the way back, 1/s: a tooth is caught up in some 0.2 s, at less than 1 rad/s.
const RATE_PER_S: f64 = 25.0;

/// An offset smaller than this is over, rad.
const OVER_RAD: f64 = 1e-6;

/// Where command and rotor stand to each other.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Recovery {
    /// Tooth pitches between the command and the angle that it holds.
    pub teeth: i64,
    /// Tooth pitches lost since arming, in whatever direction.
    pub lost_teeth: u64,
    /// How far the target is behind the reference while it comes back, rad, and its rate, rad/s.
    offset_rad: f64,
    offset_rad_per_s: f64,
    /// The lag of the reading before, lost teeth aside, electrical rad.
    before_rad: f64,
}

impl Recovery {
    /// Begins with the rotor in the tooth that a lag (electrical, rad) says.
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

    /// Takes the rotor for where it is: `behind_rad` behind the reference and getting further at a rate, with this lag.
    pub(crate) fn resynchronise(&mut self, electrical_lag_rad: f64, behind_rad: f64, behind_rad_per_s: f64) {
        let teeth = (electrical_lag_rad / TAU).round() as i64;
        self.lost_teeth = self.lost_teeth.saturating_add(teeth.abs_diff(self.teeth));
        self.teeth = teeth;
        self.offset_rad = behind_rad;
        self.offset_rad_per_s = behind_rad_per_s;
        self.before_rad = 0.0;
    }

    /// How far the target is behind the reference, rad.
    pub(crate) fn offset_rad(&self) -> f64 {
        self.offset_rad
    }

    /// The target that belongs to a reference, a cycle after the one before.
    pub(crate) fn target(&mut self, reference: &Reference, period_s: f64) -> Reference {
        if self.offset_rad == 0.0 && self.offset_rad_per_s == 0.0 {
            return *reference;
        }
        let fading = (-RATE_PER_S * period_s).exp();
        let pull = self.offset_rad_per_s + RATE_PER_S * self.offset_rad;
        let offset_rad = (self.offset_rad + pull * period_s) * fading;
        let rate = self.offset_rad_per_s * fading - RATE_PER_S * pull * period_s * fading;
        (self.offset_rad, self.offset_rad_per_s) = (offset_rad, rate);
        if offset_rad.abs() < OVER_RAD && rate.abs() < OVER_RAD * RATE_PER_S {
            (self.offset_rad, self.offset_rad_per_s) = (0.0, 0.0);
        }
        Reference {
            angle_rad: reference.angle_rad - offset_rad,
            speed_rad_per_s: reference.speed_rad_per_s - rate,
            acceleration_rad_per_s2: reference.acceleration_rad_per_s2
                + RATE_PER_S * (2.0 * rate + RATE_PER_S * offset_rad),
            ..*reference
        }
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
    fn the_target_leaves_the_rotor_smoothly_and_arrives() {
        let mut recovery = Recovery::default();
        recovery.resynchronise(TAU, 0.1257, 3.0);
        assert_eq!((recovery.teeth, recovery.lost_teeth), (1, 1));
        let reference = Reference { angle_rad: 1.0, ..Reference::default() };
        let (mut angle_rad, mut speed) = (1.0 - 0.1257, -3.0);
        for _ in 0..1000 {
            let target = recovery.target(&reference, 1e-3);
            assert!((target.speed_rad_per_s - speed).abs() < 0.3, "{} after {speed}", target.speed_rad_per_s);
            assert!((target.angle_rad - angle_rad - 1e-3 * target.speed_rad_per_s).abs() < 2e-4);
            (angle_rad, speed) = (target.angle_rad, target.speed_rad_per_s);
        }
        assert_eq!(recovery.target(&reference, 1e-3), reference);
    }
}

//! Lost steps: seen from the load angle; and how the command finds back to a rotor, or to the reference, without a jerk.
//!
//! Beyond 180° of electrical lag the motor pulls into the next tooth: the command is then whole tooth pitches away from
//! the angle that it holds. Re-synchronising takes these teeth for granted, and lets the target begin where the rotor is, at
//! the rotor's speed. After a pause it begins likewise where the command went meanwhile: the reference went on unheard,
//! and a jump to it would be more than a rotor follows. From there the target comes back.

use signals::Reference;
use std::f64::consts::{PI, TAU};

/// Lag beyond 180°, electrical rad, from where a rotor that goes on does not come back; and the one that is sure at once.
/// Both lie within the tooth pitch after 180°.
const DOUBTFUL_RAD: f64 = PI + 0.6;
const CERTAIN_RAD: f64 = 1.5 * PI;

/// Rate of the way back, 1/s. A pause in which the command goes on at the way's speed takes it no further off than it was
/// if it is shorter than two over this, 80 ms: pauses one after another don't add up.
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

    /// Lets the target go on from `aim` to a reference, a cycle later, that was not heard of for a while.
    pub(crate) fn bridge(&mut self, aim: &Reference, reference: &Reference, period_s: f64) {
        let (speed, acceleration) = (reference.speed_rad_per_s, reference.acceleration_rad_per_s2);
        let before_rad = reference.angle_rad - period_s * (speed - acceleration * period_s / 2.0);
        self.offset_rad = before_rad - aim.angle_rad;
        self.offset_rad_per_s = speed - acceleration * period_s - aim.speed_rad_per_s;
    }

    /// Falls behind by so much more, rad, in a cycle for which no command went out.
    pub(crate) fn go_on(&mut self, behind_rad: f64) {
        self.offset_rad += behind_rad;
    }

    /// How far the target is behind the reference, rad.
    pub(crate) fn offset_rad(&self) -> f64 {
        self.offset_rad
    }

    /// The target that belongs to a reference, a cycle after the one before; on its way back it is accelerated by
    /// `most_rad_per_s2` at the most.
    pub(crate) fn target(&mut self, reference: &Reference, period_s: f64, most_rad_per_s2: f64) -> Reference {
        if self.offset_rad == 0.0 && self.offset_rad_per_s == 0.0 {
            return *reference;
        }
        let wanted = -RATE_PER_S * self.offset_rad;
        let acceleration =
            ((wanted - self.offset_rad_per_s) / period_s).clamp(-most_rad_per_s2, most_rad_per_s2);
        self.offset_rad += period_s * (self.offset_rad_per_s + acceleration * period_s / 2.0);
        self.offset_rad_per_s += acceleration * period_s;
        if self.offset_rad.abs() < OVER_RAD && self.offset_rad_per_s.abs() < OVER_RAD * RATE_PER_S {
            (self.offset_rad, self.offset_rad_per_s) = (0.0, 0.0);
        }
        Reference {
            angle_rad: reference.angle_rad - self.offset_rad,
            speed_rad_per_s: reference.speed_rad_per_s - self.offset_rad_per_s,
            acceleration_rad_per_s2: reference.acceleration_rad_per_s2 - acceleration,
            ..*reference
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

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

    const PERIOD_S: f64 = 1e-3;
    const MOST_RAD_PER_S2: f64 = 1500.0;

    fn turning(cycle: u64) -> Reference {
        Reference { angle_rad: 5.0 * PERIOD_S * cycle as f64, speed_rad_per_s: 5.0, ..Reference::default() }
    }

    /// Follows the reference for a second from `target` on; the target ends on it.
    fn assert_comes_back(recovery: &mut Recovery, mut target: Reference) {
        for cycle in 1..=1000 {
            let next = recovery.target(&turning(cycle), PERIOD_S, MOST_RAD_PER_S2);
            let change = next.speed_rad_per_s - target.speed_rad_per_s;
            assert!(change.abs() <= MOST_RAD_PER_S2 * PERIOD_S * (1.0 + 1e-9), "{change} rad/s in a cycle");
            assert_relative_eq!(next.acceleration_rad_per_s2, change / PERIOD_S, epsilon = 0.1);
            let mean = (next.speed_rad_per_s + target.speed_rad_per_s) / 2.0;
            assert_relative_eq!(next.angle_rad - target.angle_rad, mean * PERIOD_S, epsilon = 2.0 * OVER_RAD);
            target = next;
        }
        assert_eq!(recovery.target(&turning(1001), PERIOD_S, MOST_RAD_PER_S2), turning(1001));
    }

    #[test]
    fn the_target_leaves_a_rotor_smoothly_and_arrives() {
        let mut recovery = Recovery::default();
        recovery.resynchronise(TAU, 0.1257, 3.0);
        assert_eq!((recovery.teeth, recovery.lost_teeth), (1, 1));
        let rotor = Reference { angle_rad: -0.1257, speed_rad_per_s: 2.0, ..Reference::default() };
        assert_comes_back(&mut recovery, rotor);
    }

    proptest! {
        #[test]
        fn the_target_leaves_a_pause_smoothly_and_arrives(angle in -0.3..0.3_f64, speed in -12.0..12.0_f64) {
            let mut recovery = Recovery::default();
            let aim = Reference { angle_rad: angle, speed_rad_per_s: speed, ..Reference::default() };
            recovery.bridge(&aim, &turning(1), PERIOD_S);
            assert_comes_back(&mut recovery, aim);
        }
    }
}

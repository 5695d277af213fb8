//! The re-entry ramp: back to a reference that the command could not follow for a while, within limits of speed and
//! acceleration.
//!
//! During a stall the drive goes on at its last rate while the reference moves on; after lost steps the rotor is
//! elsewhere. A jump to the reference would lose steps, and the drive would go on at the rate of that jump through the
//! next stall. So the target starts from where command or rotor are, at their speed, and closes the offset gradually.

use serde::{Deserialize, Serialize};
use signals::Kinematics;

/// Rate at which the offset decays, 1/s. A stall shorter than two over this, 80 ms, in which the command goes on at the
/// ramp's speed leaves an offset no larger than before: stalls one after another don't add up.
const RATE_PER_S: f64 = 25.0;

/// An offset smaller than this counts as zero, rad.
const OVER_RAD: f64 = 1e-6;

/// The limits of the ramp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ReEntryLimits {
    /// The target's speed, rad/s, unless the reference itself is faster.
    pub speed_rad_per_s: f64,
    /// The target's acceleration beyond the reference's, rad/s².
    pub acceleration_rad_per_s2: f64,
}

/// How far the target is behind the reference.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ReEntry {
    offset_rad: f64,
    offset_rad_per_s: f64,
}

impl ReEntry {
    /// Starts the ramp at `aim`, where the target is taken to have been a cycle before `reference`.
    pub(crate) fn start(&mut self, aim: &Kinematics, reference: &Kinematics, period_s: f64) {
        let (speed, acceleration) = (reference.speed_rad_per_s, reference.acceleration_rad_per_s2);
        let before_rad = reference.angle_rad - period_s * (speed - acceleration * period_s / 2.0);
        self.offset_rad = before_rad - aim.angle_rad;
        self.offset_rad_per_s = speed - acceleration * period_s - aim.speed_rad_per_s;
    }

    /// How far the target is behind the reference, rad.
    pub(crate) fn offset_rad(&self) -> f64 {
        self.offset_rad
    }

    /// The target that belongs to a reference, a cycle after the one before.
    pub(crate) fn target(
        &mut self,
        reference: &Kinematics,
        period_s: f64,
        limits: &ReEntryLimits,
    ) -> Kinematics {
        if self.offset_rad == 0.0 && self.offset_rad_per_s == 0.0 {
            return *reference;
        }
        let most = limits.acceleration_rad_per_s2;
        let wanted = self.wanted_rad_per_s(reference.speed_rad_per_s, limits);
        let acceleration = ((wanted - self.offset_rad_per_s) / period_s).clamp(-most, most);
        self.offset_rad += period_s * (self.offset_rad_per_s + acceleration * period_s / 2.0);
        self.offset_rad_per_s += acceleration * period_s;
        if self.offset_rad.abs() < OVER_RAD && self.offset_rad_per_s.abs() < OVER_RAD * RATE_PER_S {
            (self.offset_rad, self.offset_rad_per_s) = (0.0, 0.0);
        }
        Kinematics {
            angle_rad: reference.angle_rad - self.offset_rad,
            speed_rad_per_s: reference.speed_rad_per_s - self.offset_rad_per_s,
            acceleration_rad_per_s2: reference.acceleration_rad_per_s2 - acceleration,
            ..*reference
        }
    }

    /// The rate at which the offset shall shrink: proportional to it, but with half the acceleration to spare for
    /// braking, and within the target's speed.
    fn wanted_rad_per_s(&self, reference_rad_per_s: f64, limits: &ReEntryLimits) -> f64 {
        let distance_rad = self.offset_rad.abs();
        let braked = (limits.acceleration_rad_per_s2 * distance_rad).sqrt();
        let closing = (RATE_PER_S * distance_rad).min(braked).copysign(self.offset_rad);
        let top = limits.speed_rad_per_s.max(reference_rad_per_s.abs());
        reference_rad_per_s - (reference_rad_per_s + closing).clamp(-top, top)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    const PERIOD_S: f64 = 1e-3;

    fn turning(cycle: u64) -> Kinematics {
        Kinematics { angle_rad: 5.0 * PERIOD_S * cycle as f64, speed_rad_per_s: 5.0, ..Kinematics::default() }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn the_target_starts_smoothly_and_arrives(
            angle_rad in -0.3..0.3_f64, speed_rad_per_s in -12.0..12.0_f64, acceleration in 100.0..3000.0_f64,
        ) {
            let limits = ReEntryLimits { speed_rad_per_s: 12.0, acceleration_rad_per_s2: acceleration };
            let mut re_entry = ReEntry::default();
            let mut target = Kinematics { angle_rad, speed_rad_per_s, ..Kinematics::default() };
            re_entry.start(&target, &turning(1), PERIOD_S);
            for cycle in 1..=2000 {
                let next = re_entry.target(&turning(cycle), PERIOD_S, &limits);
                let change = next.speed_rad_per_s - target.speed_rad_per_s;
                prop_assert!(change.abs() <= acceleration * PERIOD_S * (1.0 + 1e-9), "{change} rad/s in a cycle");
                prop_assert!(next.speed_rad_per_s.abs() <= 12.0 * (1.0 + 1e-9), "{} rad/s", next.speed_rad_per_s);
                assert_relative_eq!(next.acceleration_rad_per_s2, change / PERIOD_S, epsilon = 0.1);
                let mean = (next.speed_rad_per_s + target.speed_rad_per_s) / 2.0;
                assert_relative_eq!(next.angle_rad - target.angle_rad, mean * PERIOD_S, epsilon = 2.0 * OVER_RAD);
                target = next;
            }
            prop_assert_eq!(re_entry.target(&turning(2001), PERIOD_S, &limits), turning(2001));
        }
    }

    #[test]
    fn a_reference_at_the_greatest_speed_is_caught_up_once_it_slows_down() {
        let limits = ReEntryLimits { speed_rad_per_s: 5.0, acceleration_rad_per_s2: 1500.0 };
        let mut re_entry = ReEntry::default();
        let behind = Kinematics { angle_rad: -0.1, ..turning(0) };
        re_entry.start(&behind, &turning(1), PERIOD_S);
        let far: Vec<f64> = (1..=500)
            .map(|cycle| re_entry.target(&turning(cycle), PERIOD_S, &limits).speed_rad_per_s)
            .collect();
        assert!(far.iter().all(|speed| *speed <= 5.0));
        assert_relative_eq!(re_entry.offset_rad(), 0.1, epsilon = 1e-9);
        let rests = Kinematics { angle_rad: 2.5, ..Kinematics::default() };
        let last = (0..1000).map(|_| re_entry.target(&rests, PERIOD_S, &limits)).last();
        assert_eq!(last, Some(rests));
    }
}

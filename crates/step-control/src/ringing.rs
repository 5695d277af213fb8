//! How much a command that is linear over long cycles excites the resonance of motor and load.
//!
//! Between two cycles the command's speed changes by Δω at once. Where a cycle is longer than half a period of the
//! resonance, nothing evens that out: the rotor rings with a torque of amplitude J·ω₀·Δω. While the valve slides, only
//! viscous friction damps that, since Coulomb friction does not change its sign; about a standstill it takes 4·T_c off the
//! amplitude in a period. Shorter cycles follow the reference's own ramps, which are made not to excite the resonance.

use crate::params::Params;
use serde::{Deserialize, Serialize};
use signals::Kinematics;

/// Ringing below this fraction of Coulomb friction is quiet.
const QUIET: f64 = 0.1;

/// Ringing above this fraction of Coulomb friction relaxes the bristles: it takes some of the torque that keeps them deflected.
const RINGS: f64 = 0.75;

/// The amplitude of the ringing torque.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ringing {
    /// Amplitude of the present ringing, N·m.
    amplitude_nm: f64,
    /// The same with the ringing that the target's acceleration will excite at the end of the cycle.
    soon_nm: f64,
}

impl Ringing {
    /// The ringing a cycle later, if the target's motion per cycle changed by `turn_rad` at the cycle's beginning.
    pub(crate) fn next(self, params: &Params, turn_rad: f64, target: &Kinematics, rests: bool) -> Self {
        let half_period_s = params.half_period_s();
        if params.period_s <= half_period_s {
            return Self::default();
        }
        let omega = std::f64::consts::PI / half_period_s;
        let excited_nm = |change_rad_per_s: f64| params.inertia_kg_m2 * omega * change_rad_per_s.abs();
        let left_nm = if rests {
            self.amplitude_nm - 2.0 * params.coulomb_torque_nm * params.period_s / half_period_s
        } else {
            let damping = params.motor.damping_nm_s_per_rad + params.viscous_nm_s_per_rad;
            self.amplitude_nm * (-damping * params.period_s / (2.0 * params.inertia_kg_m2)).exp()
        };
        let amplitude_nm = left_nm.max(excited_nm(turn_rad / params.period_s));
        let soon_nm = amplitude_nm.max(excited_nm(target.acceleration_rad_per_s2 * params.period_s));
        Self { amplitude_nm, soon_nm }
    }

    /// Whether the ringing hardly shows in the load angle. Readings once in a period always meet it at the same phase, so that
    /// it would look like a torque.
    pub(crate) fn is_quiet(self, params: &Params) -> bool {
        self.amplitude_nm < QUIET * params.coulomb_torque_nm
    }

    /// Whether the rotor oscillates, or soon will, beyond what friction holds: its bristles relax then, and the belief's do
    /// not. If it slides faster than it oscillates, the direction never changes, and its bristles stay deflected.
    pub(crate) fn relaxes(self, params: &Params, speed_rad_per_s: f64) -> bool {
        let omega = std::f64::consts::PI / params.half_period_s();
        let swings_rad_per_s = self.soon_nm / (params.inertia_kg_m2 * omega);
        self.soon_nm > RINGS * params.coulomb_torque_nm && speed_rad_per_s.abs() < swings_rad_per_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::tests::params;

    fn moves(acceleration_rad_per_s2: f64) -> Kinematics {
        Kinematics { acceleration_rad_per_s2, ..Kinematics::default() }
    }

    #[test]
    fn long_cycles_ring_by_the_change_of_speed_and_short_ones_do_not() {
        // J·ω₀·Δω = 5e-4·775·4 rad/s: 1.55 N·m, about the Coulomb torque.
        for (period_s, rings) in [(1e-3, false), (4e-3, false), (8e-3, true)] {
            let params = Params { period_s, ..params() };
            let by_turn = Ringing::default().next(&params, 4.0 * period_s, &moves(0.0), false);
            assert_eq!(by_turn.relaxes(&params, 0.0), rings, "{period_s} s");
            assert_eq!(by_turn.is_quiet(&params), !rings, "{period_s} s");
            let soon = Ringing::default().next(&params, 0.0, &moves(4.0 / period_s), false);
            assert_eq!(soon.relaxes(&params, 0.0), rings, "{period_s} s");
            assert!(soon.is_quiet(&params), "nothing rings yet");
        }
    }

    #[test]
    fn at_rest_friction_ends_it_sooner_than_while_sliding() {
        let params = Params { period_s: 8e-3, ..params() };
        let struck = Ringing::default().next(&params, 8.0 * 8e-3, &moves(0.0), false);
        let cycles = |rests: bool| {
            let mut ringing = struck;
            (0..1000).find(|_| {
                ringing = ringing.next(&params, 0.0, &moves(0.0), rests);
                !ringing.relaxes(&params, 0.0)
            })
        };
        let (resting, sliding) = (cycles(true).unwrap(), cycles(false).unwrap());
        assert!(resting < 2 && sliding > 4, "{resting} cycles at rest, {sliding} while sliding");
    }

    #[test]
    fn a_valve_that_slides_faster_than_it_swings_keeps_its_bristles_bent() {
        // A change by 4 rad/s makes it oscillate at that speed.
        let params = Params { period_s: 8e-3, ..params() };
        let ringing = Ringing::default().next(&params, 4.0 * 8e-3, &moves(0.0), false);
        for (speed, relaxes) in [(0.0, true), (3.9, true), (-3.9, true), (4.1, false), (-4.1, false)] {
            assert_eq!(ringing.relaxes(&params, speed), relaxes, "{speed} rad/s");
        }
    }
}

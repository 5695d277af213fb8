//! Which share of the believed friction the valve has, measured by the load angle while it slides.
//!
//! A stepper's load angle is a torque sensor. While the valve slides along its reference,
//!
//! T_hold·sin(N_r·(θ_cmd − θ)) − D·ω = κ·F + ι·J·a + e
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | θ_cmd, θ | command and encoder's angle at the time of a reading | rad |
//! | F | friction torque that the belief expects there | N·m |
//! | J·a | believed inertia times the reference's acceleration | N·m |
//! | κ, ι | shares of believed friction and inertia that the valve has | 1 |
//! | e | ringing, detent, load: zero on average | N·m |
//!
//! κ and ι are estimated by least squares with exponential forgetting, from 1 and 1. Ringing makes successive readings
//! dependent: one per half period of the resonance counts. Slow sliding is left out, where stick and slip decide the
//! load angle, and so is rest, where friction takes any torque up to break-away.

use crate::params::Params;
use serde::{Deserialize, Serialize};
use signals::Kinematics;

/// Time constant of forgetting, s of sliding.
const FORGETTING_S: f64 = 0.5;

/// Half periods of the resonance that the valve must have slid before the estimate is used.
const HALF_PERIODS: f64 = 4.0;

/// The estimate is used once it deviates from 1 by this at [`CONFIDENCE`] standard errors, clipped to the greatest: a valve that takes more
/// has another fault.
const CLEARLY: f64 = 0.1;
const CONFIDENCE: f64 = 2.0;
const GREATEST: f64 = 1.5;

/// Below this at the same confidence there is an alarm: friction varies by less with temperature and from batch to batch of oil.
const CLEARLY_BELOW: f64 = 0.8;

/// An inertia that is off by this part at the same confidence raises an alarm: the observer's design is stable up to about there.
const OTHER_INERTIA: f64 = 0.35;

/// The fraction of the believed friction that is fed forward in long cycles before the load angle has confirmed it. It makes
/// nothing worse on a valve that has at least half of that, a quarter of the believed friction.
const DOUBTED: f64 = 0.5;

/// Friction within this part of Coulomb and viscous friction counts as sliding, not as creeping.
const SLIDING: f64 = 1.1;

/// The torques that the belief expects at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Expected {
    /// Speed of the reference, rad/s.
    pub speed_rad_per_s: f64,
    /// F.
    pub friction_nm: f64,
    /// J·a.
    pub inertia_nm: f64,
}

impl Expected {
    /// Of a motion, and of the friction torque that the belief expects for it.
    pub(crate) fn of(params: &Params, target: &Kinematics, friction_nm: f64) -> Self {
        Self {
            speed_rad_per_s: target.speed_rad_per_s,
            friction_nm,
            inertia_nm: params.inertia_kg_m2 * target.acceleration_rad_per_s2,
        }
    }

    fn slides(&self, params: &Params) -> bool {
        let speed = self.speed_rad_per_s.abs();
        let sliding_nm = params.coulomb_torque_nm + params.viscous_nm_s_per_rad * speed;
        speed > 0.0 && params.friction.steady_torque(speed) <= SLIDING * sliding_nm
    }
}

/// Sums over the readings, each with less weight the longer ago.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LoadShare {
    readings: f64,
    /// Σ F², Σ F·J·a, Σ (J·a)².
    friction_2: f64,
    across: f64,
    inertia_2: f64,
    /// With r the torque measured beyond F + J·a: Σ F·r, Σ J·a·r, Σ r².
    friction_beyond: f64,
    inertia_beyond: f64,
    beyond_2: f64,
    /// Whether the share was once clearly different from 1, clearly low, clearly high, and clearly not low.
    differs: bool,
    below: bool,
    above: bool,
    confirmed: bool,
    /// Whether the inertia was once clearly different.
    other_inertia: bool,
}

impl LoadShare {
    /// Takes in a reading: the motor's torque less its own damping, and what was expected.
    pub(crate) fn step(&mut self, params: &Params, expected: &Expected, torque_nm: f64) {
        if !expected.slides(params) {
            return;
        }
        let keeps = (-params.period_s / FORGETTING_S).exp();
        let (friction, inertia) = (expected.friction_nm, expected.inertia_nm);
        let beyond = torque_nm - friction - inertia;
        let sums = [
            (&mut self.readings, 1.0),
            (&mut self.friction_2, friction * friction),
            (&mut self.across, friction * inertia),
            (&mut self.inertia_2, inertia * inertia),
            (&mut self.friction_beyond, friction * beyond),
            (&mut self.inertia_beyond, inertia * beyond),
            (&mut self.beyond_2, beyond * beyond),
        ];
        for (sum, term) in sums {
            *sum = keeps * *sum + term;
        }
        if self.readings * params.period_s > HALF_PERIODS * params.half_period_s() {
            let Estimate { share, error, inertia_share, inertia_error } = self.estimate(params);
            let inertia_off = (inertia_share - 1.0).abs() - CONFIDENCE * inertia_error;
            // Only active damping depends on the inertia; and in longer cycles the rotor does not follow the acceleration.
            let matters = params.observer.is_some_and(|observer| observer.settings.damps);
            self.other_inertia |= matters && inertia_off > OTHER_INERTIA;
            self.differs |= (share - 1.0).abs() - CONFIDENCE * error > CLEARLY;
            self.below |= share + CONFIDENCE * error < CLEARLY_BELOW;
            self.above |= share - CONFIDENCE * error > GREATEST;
            self.confirmed |= share - CONFIDENCE * error > DOUBTED;
        }
    }

    /// Whether another share than 1 is fed; kept until the next arming.
    pub(crate) fn differs(&self) -> bool {
        self.differs
    }

    /// Whether the inertia clearly differs from the belief; kept until the next arming.
    pub(crate) fn other_inertia(&self) -> bool {
        self.other_inertia
    }

    /// Whether the valve has clearly less friction than believed; kept until the next arming.
    pub(crate) fn below_belief(&self) -> bool {
        self.below
    }

    /// Whether the valve clearly has more than 1.5 times the believed friction, or seems to: an encoder with a play as large as
    /// the lag from friction looks the same. Kept until the next arming.
    pub(crate) fn above_belief(&self) -> bool {
        self.above
    }

    /// The part of the believed friction to feed forward: all of it, or the estimated share if that clearly differs. With
    /// `doubts` less, until the load angle has confirmed the belief.
    pub(crate) fn used(&self, params: &Params, doubts: bool) -> f64 {
        if self.differs {
            self.estimate(params).share.clamp(0.0, GREATEST)
        } else if self.confirmed || !doubts {
            1.0
        } else {
            DOUBTED
        }
    }

    fn estimate(&self, params: &Params) -> Estimate {
        // A prior of one reading at Coulomb friction, so that the estimate always exists.
        let prior = params.coulomb_torque_nm * params.coulomb_torque_nm + f64::MIN_POSITIVE;
        let (friction_2, inertia_2) = (self.friction_2 + prior, self.inertia_2 + prior);
        let determinant = friction_2 * inertia_2 - self.across * self.across;
        let friction = (inertia_2 * self.friction_beyond - self.across * self.inertia_beyond) / determinant;
        let inertia = (friction_2 * self.inertia_beyond - self.across * self.friction_beyond) / determinant;
        let explained = friction * self.friction_beyond + inertia * self.inertia_beyond;
        let residual_2 = (self.beyond_2 - explained).max(0.0) / self.readings.max(1.0);
        let dependent = (params.half_period_s() / params.period_s).max(1.0);
        let error = |other_2: f64| (residual_2 * dependent * other_2 / determinant).sqrt();
        Estimate {
            share: 1.0 + friction,
            error: error(inertia_2),
            inertia_share: 1.0 + inertia,
            inertia_error: error(friction_2),
        }
    }
}

/// κ, ι and their standard errors.
struct Estimate {
    share: f64,
    error: f64,
    inertia_share: f64,
    inertia_error: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::tests::params;
    use approx::assert_relative_eq;

    /// Readings of a valve with these shares that moves to and fro at this speed, ringing at the resonance.
    fn seen(share: f64, inertia_share: f64, ringing_nm: f64, speed_rad_per_s: f64) -> (Params, LoadShare) {
        let params = params();
        let mut found = LoadShare::default();
        for cycle in 0..400 {
            let time_s = f64::from(cycle) * params.period_s;
            let direction = if cycle / 100 % 2 == 0 { 1.0 } else { -1.0 };
            let expected = Expected {
                speed_rad_per_s: direction * speed_rad_per_s,
                friction_nm: direction * params.coulomb_torque_nm,
                inertia_nm: 0.4 * (60.0 * time_s).sin(),
            };
            let rings_nm = ringing_nm * (std::f64::consts::PI / params.half_period_s() * time_s).sin();
            let torque_nm = share * expected.friction_nm + inertia_share * expected.inertia_nm + rings_nm;
            found.step(&params, &expected, torque_nm);
        }
        (params, found)
    }

    #[test]
    fn shares_are_found_apart_and_below_the_belief_is_told() {
        for share in [0.0, 0.3, 0.7, 1.0, 1.4] {
            for inertia_share in [0.5, 1.0, 2.0] {
                let (params, found) = seen(share, inertia_share, 0.3, 2.0);
                let estimate = found.estimate(&params);
                assert_relative_eq!(estimate.share, share, epsilon = 0.05);
                assert_relative_eq!(estimate.inertia_share, inertia_share, epsilon = 0.15);
                assert_eq!(found.below_belief(), share < 0.75, "{share}");
                assert_eq!(found.confirmed, share >= 0.7, "{share}");
                let used = if share == 1.0 { 1.0 } else { estimate.share };
                assert_eq!(found.used(&params, false), used, "{share}");
            }
        }
    }

    #[test]
    fn what_is_not_certain_changes_nothing() {
        // Ringing as large as friction; a share within the usual spread; creeping; too few readings.
        for (share, ringing_nm, speed) in [(0.75, 3.0, 2.0), (0.95, 0.0, 2.0), (0.2, 0.0, 0.02)] {
            let (params, found) = seen(share, 1.0, ringing_nm, speed);
            assert!(!found.below_belief() && !found.differs, "{share}, {ringing_nm} N·m, {speed} rad/s");
            assert_eq!(found.used(&params, false), 1.0);
        }
        let (params, none) = (params(), LoadShare::default());
        assert_eq!((none.used(&params, false), none.used(&params, true)), (1.0, DOUBTED));
    }

    #[test]
    fn no_more_than_half_as_much_again_is_fed() {
        let (params, found) = seen(3.0, 1.0, 0.1, 2.0);
        assert_eq!(found.used(&params, false), GREATEST);
    }

    #[test]
    fn more_than_can_be_fed_is_told() {
        for (share, told) in [(1.0, false), (1.4, false), (1.7, true), (3.0, true)] {
            let (_, found) = seen(share, 1.0, 0.1, 2.0);
            assert_eq!(found.above_belief(), told, "{share}");
        }
        let (_, uncertain) = seen(1.6, 1.0, 6.0, 2.0);
        assert!(!uncertain.above_belief(), "ringing four times as large as friction");
    }
}

//! The controller's settings: its belief of the valve, its limits, its reactions.

use crate::homing_params::Homing;
use crate::observer::design::design;
use crate::observer::shaft::Shaft;
use crate::observer::{Observer, ObserverSettings, suited_hz};
use crate::reference::re_entry::ReEntryLimits;
use crate::reference::shaper::Shaper;
use serde::{Deserialize, Serialize};
use signals::Reference;
use std::f64::consts::PI;
use thiserror::Error;
use valve_model::{FrictionLaw, MotionParams, MotorParams};

/// How much friction the controller compensates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Compensation {
    /// None: the command is the reference.
    None,
    /// Coulomb and viscous friction on the reference's speed, smooth through zero.
    CoulombViscous,
    /// The belief's whole friction law, driven by the reference.
    Full,
    /// The same with the belief's effects: what loads the spool beside friction, and what changes friction.
    FullWithEffects,
}

/// The reaction to lost steps, if an encoder shows them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum LostSteps {
    /// A fault.
    Fault,
    /// The command restarts from where the rotor is, and returns to the reference on a re-entry ramp.
    Resynchronise,
}

/// The limits of motion that a reference must keep; the trajectory gets the same.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReferenceLimits {
    /// The smallest angle, rad; `None` for a valve that turns.
    pub min_angle_rad: Option<f64>,
    /// The largest angle, rad; `None` for a valve that turns.
    pub max_angle_rad: Option<f64>,
    /// The largest speed, rad/s.
    pub max_speed_rad_per_s: f64,
    /// The largest speed while the valve is not homed, rad/s; limits of angle mean nothing then.
    pub unhomed_speed_rad_per_s: f64,
}

impl ReferenceLimits {
    /// Tolerance for a healthy trajectory's rounding: relative to a speed, and in rad.
    const SLACK: f64 = 0.01;
    const SLACK_RAD: f64 = 1e-3;

    /// Whether a reference is faster than allowed, or beyond an end and on its way further out. A reference beyond a
    /// limit that rests or moves inwards is allowed: a valve may have been armed there.
    pub(crate) fn exceeded(&self, reference: &Reference, homed: bool) -> bool {
        let (angle, speed) = (reference.angle_rad, reference.speed_rad_per_s);
        if !homed {
            return speed.abs() > self.unhomed_speed_rad_per_s * (1.0 + Self::SLACK);
        }
        let below = self.min_angle_rad.is_some_and(|min| angle < min - Self::SLACK_RAD) && speed < 0.0;
        let above = self.max_angle_rad.is_some_and(|max| angle > max + Self::SLACK_RAD) && speed > 0.0;
        below || above || speed.abs() > self.max_speed_rad_per_s * (1.0 + Self::SLACK)
    }

    /// True if a reference is further from the extrapolation of the last one, received `time_s` ago, than a change
    /// from full speed to full speed the other way can explain.
    pub(crate) fn leapt(&self, leap_rad: f64, time_s: f64) -> bool {
        leap_rad.abs() > 2.0 * self.max_speed_rad_per_s * (1.0 + Self::SLACK) * time_s + Self::SLACK_RAD
    }
}

/// The controller's settings; [`Params::validate`] once, before the first step.
///
/// ```
/// use signals::{Feedback, OperatorCommand, OperatorKind, Reference, validity};
/// use step_control::{Compensation, Input, LostSteps, Params, ReferenceLimits, State, step};
/// use valve_model::{FrictionLaw, LuGreParams, Model, MotionParams, MotorParams};
///
/// let (belief, friction, motor) = (Model::bench_rig(), LuGreParams::BENCH_RIG, MotorParams::BENCH_RIG);
/// let params = Params {
///     period_s: 1e-3,
///     loop_delay_cycles: 1,
///     motor,
///     inertia_kg_m2: 5e-4,
///     friction: FrictionLaw::new(&belief.friction),
///     with_effects: MotionParams::new(&belief).unwrap(),
///     coulomb_torque_nm: friction.coulomb_torque_nm,
///     viscous_nm_s_per_rad: friction.viscous_nm_s_per_rad,
///     compensation: Compensation::Full,
///     observer: None,
///     shaper: None,
///     encoder_delay_cycles: 0,
///     lost_steps: LostSteps::Fault,
///     homing: None,
///     holds_when_disarmed: false,
///     drive: drive::Params {
///         period_s: 1e-3,
///         microstep_angle_rad: motor.microstep_angle_rad(),
///         max_pulse_rate_hz: 600e3,
///         max_pulse_acceleration_hz_per_s: 400e6,
///         quick_stop_deceleration_hz_per_s: 10e6,
///         after_stop: drive::AfterStop::Hold,
///         silence_cycles: 3,
///         energise_cycles: 0,
///         lowest_angle_rad: None,
///         highest_angle_rad: None,
///         standstill_rad: 1e-4,
///     },
///     reference_limits: ReferenceLimits {
///         min_angle_rad: None,
///         max_angle_rad: None,
///         max_speed_rad_per_s: 10.0,
///         unhomed_speed_rad_per_s: 0.2,
///     },
///     max_following_error_rad: 0.05,
///     following_error_per_speed_s: 0.0,
///     arm_at_cycle: None,
///     disarm_at_cycle: None,
/// };
/// params.validate().unwrap();
///
/// // The drive stands still with current on; the operator arms.
/// let mut state = State::new(0);
/// let flags = validity::STANDSTILL | validity::ENERGISED | validity::HOMED;
/// let feedback = Feedback { validity: flags, ..Feedback::default() };
/// let arm = OperatorCommand {
///     id: 1,
///     kind: OperatorKind::Arm.code(),
///     valid_until_cycle: 10,
///     ..OperatorCommand::default()
/// };
/// let rests = Reference::default();
/// let input = Input { feedback: Some(&feedback), reference: Some(&rests), order: Some(&arm) };
/// assert_eq!(step(&params, &mut state, 0, &input).command.follow, 1);
///
/// // The reference starts to move: the command leads it, so that the motor's torque balances friction.
/// let moves = Reference { angle_rad: 1e-4, speed_rad_per_s: 0.1, ..Reference::default() };
/// let input = Input { reference: Some(&moves), order: None, ..input };
/// let command = step(&params, &mut state, 1, &input).command;
/// let lead_rad = command.position_unrounded * motor.microstep_angle_rad() - moves.angle_rad;
/// assert!(lead_rad > 0.0);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Params {
    /// Length of a cycle, s.
    pub period_s: f64,
    /// Cycles from Feedback to the beginning of the command's cycle, 1 or 2.
    pub loop_delay_cycles: u64,
    /// The motor, as believed.
    pub motor: MotorParams,
    /// Rotor and load together, as believed, kg·m².
    pub inertia_kg_m2: f64,
    /// The friction law, as believed.
    pub friction: FrictionLaw,
    /// The friction law and all else that loads the spool, effects included, as believed.
    pub with_effects: MotionParams,
    /// The belief's Coulomb torque, N·m.
    pub coulomb_torque_nm: f64,
    /// The belief's viscous coefficient, N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
    /// How much friction is compensated.
    pub compensation: Compensation,
    /// The disturbance observer, where an encoder is fitted and it is wanted; made by [`Params::with_observer`].
    pub observer: Option<Observer>,
    /// The input shaper, where it is wanted; made by [`Params::with_shaper`].
    pub shaper: Option<Shaper>,
    /// Age of the encoder's reading in Feedback, cycles.
    pub encoder_delay_cycles: u64,
    /// The reaction to lost steps.
    pub lost_steps: LostSteps,
    /// How to home, where that is possible.
    pub homing: Option<Homing>,
    /// Whether the motor carries current while the controller is disarmed.
    pub holds_when_disarmed: bool,
    /// The driver's limits; the drive enforces the same, last.
    pub drive: drive::Params,
    /// The limits of a reference; beyond them is a fault.
    pub reference_limits: ReferenceLimits,
    /// Following error at rest that is a fault, rad, against what the command aimed at: the reference, shaped, or
    /// coming back to it.
    pub max_following_error_rad: f64,
    /// By how much that grows with the reference's speed, s.
    pub following_error_per_speed_s: f64,
    /// Arms by itself in this cycle: for simulated scenarios.
    pub arm_at_cycle: Option<u64>,
    /// Disarms by itself in this cycle: for simulated scenarios.
    pub disarm_at_cycle: Option<u64>,
}

/// An invalid setting.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum ControlError {
    /// A number out of its range.
    #[error("`{key}` is {found}, expected {expected}")]
    Number {
        /// The field's name.
        key: &'static str,
        /// The value found.
        found: f64,
        /// What would have been accepted.
        expected: &'static str,
    },
    /// The driver's limits are wrong.
    #[error(transparent)]
    Drive(#[from] drive::DriveError),
}

/// The part of the holding torque that a re-entry ramp may accelerate with: it leaves the motor most of its torque and
/// hardly excites the resonance.
const RE_ENTRY_PART: f64 = 1.0 / 8.0;

/// Damping ratio below which a rotor rings on its bristles for more than one and a half periods.
const RINGS_BELOW: f64 = 0.1;

impl Params {
    /// These settings with an observer designed for them.
    #[must_use]
    pub fn with_observer(self, settings: ObserverSettings) -> Self {
        let observer = design(&self.shaft(), settings, self.age_cycles(&settings));
        Self { observer: Some(observer), ..self }
    }

    /// The observer's bandwidth that suits belief and encoder, Hz: that of one with counts of `count_rad` and a noise of `noise_rad` (RMS).
    pub fn suited_bandwidth_hz(&self, count_rad: f64, noise_rad: f64) -> f64 {
        suited_hz(&self.shaft(), self.coulomb_torque_nm, count_rad, noise_rad)
    }

    /// Cycles from a reading to the end of the newest command.
    pub(crate) fn age_cycles(&self, settings: &ObserverSettings) -> usize {
        (self.loop_delay_cycles + settings.delay_cycles) as usize
    }

    /// Motor and load as believed, sliding on the motor's spring.
    pub(crate) fn shaft(&self) -> Shaft {
        Shaft {
            inertia_kg_m2: self.inertia_kg_m2,
            stiffness_nm_per_rad: self.stiffness_nm_per_rad(),
            damping_nm_s_per_rad: self.motor.damping_nm_s_per_rad,
            period_s: self.period_s,
        }
    }

    /// These settings with an input shaper for the believed resonance of motor and load in sliding; without one where
    /// there is no such resonance, or half its period is longer than the shaper remembers.
    #[must_use]
    pub fn with_shaper(self) -> Self {
        let stiffness = self.stiffness_nm_per_rad();
        let frequency = (stiffness / self.inertia_kg_m2).sqrt();
        let damping = self.motor.damping_nm_s_per_rad + self.viscous_nm_s_per_rad;
        let ratio = damping / (2.0 * (stiffness * self.inertia_kg_m2).sqrt());
        Self { shaper: Shaper::design(frequency, ratio, self.period_s), ..self }
    }

    /// Whether a rotor that stops rings on its bristles for some periods: its damping ratio there is below a tenth. Friction
    /// relaxes then, and no longer holds the torque that the motion left.
    pub(crate) fn bristles_ring(&self) -> bool {
        let stiffness = self.stiffness_nm_per_rad() + self.friction.bristle_stiffness_nm_per_rad();
        let damping = self.motor.damping_nm_s_per_rad + self.friction.bristle_damping_nm_s_per_rad();
        damping < 2.0 * RINGS_BELOW * (stiffness * self.inertia_kg_m2).sqrt()
    }

    /// Half a period of the believed resonance of motor and load, s.
    pub(crate) fn half_period_s(&self) -> f64 {
        PI * (self.inertia_kg_m2 / self.stiffness_nm_per_rad()).sqrt()
    }

    /// The motor's torque by load angle K, about zero, N·m/rad.
    pub(crate) fn stiffness_nm_per_rad(&self) -> f64 {
        self.motor.holding_torque_nm * f64::from(self.motor.rotor_teeth)
    }

    /// The limits of a re-entry ramp.
    pub(crate) fn re_entry_limits(&self) -> ReEntryLimits {
        ReEntryLimits {
            speed_rad_per_s: self.reference_limits.max_speed_rad_per_s,
            acceleration_rad_per_s2: RE_ENTRY_PART * self.motor.holding_torque_nm / self.inertia_kg_m2,
        }
    }

    /// Checks all numbers that this crate uses itself; motor and friction are validated where they are made.
    ///
    /// # Errors
    /// The first that is not finite, not positive where it must be, or out of range.
    pub fn validate(&self) -> Result<(), ControlError> {
        let positive = [
            ("period_s", self.period_s),
            ("inertia_kg_m2", self.inertia_kg_m2),
            ("max_following_error_rad", self.max_following_error_rad),
            ("reference_limits.max_speed_rad_per_s", self.reference_limits.max_speed_rad_per_s),
        ];
        for (key, found) in positive {
            if !(found > 0.0 && found.is_finite()) {
                return Err(ControlError::Number { key, found, expected: "a finite number above 0" });
            }
        }
        if !(1..=2).contains(&self.loop_delay_cycles) {
            let found = self.loop_delay_cycles as f64;
            return Err(ControlError::Number { key: "loop_delay_cycles", found, expected: "1 or 2" });
        }
        Ok(self.drive.validate()?)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::bench_rig;

    /// A controller of the bench rig with full compensation, without observer and limits of angle.
    pub(crate) fn params() -> Params {
        let rig = bench_rig::params();
        let reference_limits =
            ReferenceLimits { min_angle_rad: None, max_angle_rad: None, ..rig.reference_limits };
        Params { compensation: Compensation::Full, reference_limits, ..rig }
    }

    #[test]
    fn bristles_ring_where_nothing_damps_them() {
        use valve_model::{DahlParams, FrictionParams, LuGreParams};
        let rings = |friction: FrictionParams| {
            Params { friction: FrictionLaw::new(&friction), ..params() }.bristles_ring()
        };
        // Critical damping of 1300 N·m/rad on 5e-4 kg·m²: 1.6 N·m·s/rad. The motor has 0.02 of it.
        let lugre = |bristle_damping_nm_s_per_rad| {
            FrictionParams::LuGre(LuGreParams { bristle_damping_nm_s_per_rad, ..LuGreParams::BENCH_RIG })
        };
        assert!(!rings(lugre(1.0)) && !rings(lugre(0.15)));
        assert!(rings(lugre(0.13)) && rings(lugre(0.0)));
        assert!(rings(FrictionParams::Dahl(DahlParams {
            coulomb_torque_nm: 1.5,
            bristle_stiffness_nm_per_rad: 1000.0,
            viscous_nm_s_per_rad: 0.0,
            dahl_exponent: 1.0,
        })));
    }

    #[test]
    fn a_reference_leaps_where_no_reversal_at_full_speed_goes() {
        let limits = params().reference_limits;
        let most_rad = |time_s: f64| 2.0 * limits.max_speed_rad_per_s * 1.01 * time_s + 1e-3;
        for time_s in [1e-3, 0.05] {
            for direction in [1.0, -1.0] {
                assert!(!limits.leapt(direction * 0.999 * most_rad(time_s), time_s));
                assert!(limits.leapt(direction * 1.001 * most_rad(time_s), time_s));
            }
        }
    }
}

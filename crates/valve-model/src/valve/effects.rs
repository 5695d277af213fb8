//! A model's effects with their coefficients prepared, and what they make of friction at one moment.

use serde::{Deserialize, Serialize};

use super::customs::{Customs, Held};
use crate::effect::Series;
use crate::friction::{Contact, Lag, Levels};
use crate::{Effect, EffectId, Model};

/// The levels are never scaled below this: a law needs some friction.
const LEAST_LEVEL: f64 = 1e-3;
const PA_PER_MPA: f64 = 1e6;

/// Growth with the time at rest: gain·(1 − exp(−(t/τ)^m)).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Growth {
    gain: f64,
    per_time_constant: f64,
    exponent: f64,
}

/// Everything of section "friction's structure" and "other torques", neutral where the model has no such effect.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Effects {
    pressure_gain: f64,
    pressure_exponent: f64,
    /// At which the nominal levels hold: the seals' working pressure, 0 without.
    nominal_pressure_mpa: f64,
    viscosity_beta_per_k: f64,
    friction_beta_per_k: f64,
    reference_temperature_c: f64,
    asymmetry: f64,
    viscous_asymmetry: f64,
    dwell: Growth,
    lock: Growth,
    wear_gain: f64,
    per_wear_distance: f64,
    angle: Option<Series>,
    flow: Option<Series>,
    pressure_torque_nm_per_mpa: f64,
    position: Option<Series>,
    pub lag: Lag,
    pub coupling: Coupling,
    pub detent: Option<Series>,
    pub microstep: Option<Series>,
    pub customs: Customs,
}

/// The spring between rotor and spool, and the damper beside it; no stiffness: none.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Coupling {
    pub stiffness_nm_per_rad: f64,
    pub damping_nm_s_per_rad: f64,
}

impl Coupling {
    pub fn is_there(&self) -> bool {
        self.stiffness_nm_per_rad > 0.0
    }

    /// The torque that it carries from the rotor to the spool, by how far and how fast the one turns ahead of the other.
    #[inline]
    pub fn torque_nm(&self, ahead_rad: f64, ahead_rad_per_s: f64) -> f64 {
        self.stiffness_nm_per_rad * ahead_rad + self.damping_nm_s_per_rad * ahead_rad_per_s
    }
}

/// How the spool moves at an instant, rad and s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Moving {
    pub angle: f64,
    pub speed: f64,
    /// Where it is known.
    pub acceleration: f64,
}

/// Other torques on the spool: against the motor, N·m, and their derivative by the angle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct OtherTorque<'a> {
    constant_nm: f64,
    position: Option<&'a Series>,
    /// For each MPa, and the pressure drop, MPa.
    flow: Option<(&'a Series, f64)>,
}

impl OtherTorque<'_> {
    /// Torque and slope at a spool angle; the constant alone without `FULL`.
    #[inline]
    pub fn at<const FULL: bool>(&self, angle: f64) -> (f64, f64) {
        let mut sum = (self.constant_nm, 0.0);
        if FULL && let Some(series) = self.position {
            let (torque_nm, slope) = series.at(angle);
            sum = (sum.0 + torque_nm, sum.1 + slope);
        }
        if FULL && let Some((series, pressure_mpa)) = self.flow {
            let (torque_nm, slope) = series.at(angle);
            sum = (sum.0 + pressure_mpa * torque_nm, sum.1 + pressure_mpa * slope);
        }
        sum
    }
}

impl Growth {
    fn new(effect: &Effect) -> Self {
        Self {
            gain: effect.number("gain"),
            per_time_constant: 1.0 / effect.number("time_constant_s"),
            exponent: effect.number("exponent"),
        }
    }

    fn after(&self, rest_s: f64) -> f64 {
        if self.gain == 0.0 || rest_s <= 0.0 {
            return 0.0;
        }
        self.gain * growth_reached(rest_s * self.per_time_constant, self.exponent)
    }
}

/// The part of its growth at rest that friction has reached, 0 to 1, after a rest of so many time constants; the formula of `dwell-stiction`.
///
/// ```
/// assert!((valve_model::growth_reached(1.0, 1.0) - 0.632).abs() < 1e-3);
/// ```
#[inline]
pub fn growth_reached(time_constants: f64, exponent: f64) -> f64 {
    -(-time_constants.powf(exponent)).exp_m1()
}

impl Effects {
    pub fn new(model: &Model) -> Self {
        let working_pa = model.seals.map_or(0.0, |seals| seals.working_pressure_pa);
        let mut effects = Self {
            reference_temperature_c: model.reference_temperature_c(),
            nominal_pressure_mpa: working_pa / PA_PER_MPA,
            ..Self::default()
        };
        for effect in &model.effects {
            effects.take(effect);
        }
        effects
    }

    fn take(&mut self, effect: &Effect) {
        let series = || Series::new(effect.list("cos"), effect.list("sin"));
        match effect.id() {
            EffectId::PressureDependentFriction => {
                self.pressure_gain = effect.number("gain");
                self.pressure_exponent = effect.number("exponent");
            }
            EffectId::TemperatureDependentViscosity => {
                self.viscosity_beta_per_k = effect.number("beta_per_k")
            }
            EffectId::TemperatureDependentFriction => self.friction_beta_per_k = effect.number("beta_per_k"),
            EffectId::AngleDependentFriction => self.angle = series(),
            EffectId::DirectionAsymmetry => {
                self.asymmetry = effect.number("level");
                self.viscous_asymmetry = effect.number("viscous");
            }
            EffectId::DwellStiction => self.dwell = Growth::new(effect),
            EffectId::HydraulicLock => self.lock = Growth::new(effect),
            EffectId::FrictionLag => {
                self.lag = Lag::new(effect.number("time_constant_s"), effect.number("second_stage_share"));
            }
            EffectId::WearDrift => {
                self.wear_gain = effect.number("gain");
                self.per_wear_distance = 1.0 / effect.number("distance_rad");
            }
            EffectId::FlowTorque => self.flow = series(),
            EffectId::PressureTorque => self.pressure_torque_nm_per_mpa = effect.number("gain"),
            EffectId::PositionTorque => self.position = series(),
            EffectId::CouplingCompliance => {
                self.coupling = Coupling {
                    stiffness_nm_per_rad: effect.number("stiffness_nm_per_rad"),
                    damping_nm_s_per_rad: effect.number("damping_nm_s_per_rad"),
                };
            }
            EffectId::DetentTorque => self.detent = series(),
            EffectId::MicrostepError => self.microstep = series(),
            EffectId::Custom(_) => self.customs.take(effect),
            // These are folded into the model's numbers, or belong to the measurement.
            EffectId::CoulombLevel
            | EffectId::StaticLevel
            | EffectId::ViscousLevel
            | EffectId::StribeckVelocity
            | EffectId::BristleStiffness
            | EffectId::BristleDamping
            | EffectId::RotorInertia
            | EffectId::MotorDamping
            | EffectId::LoadInertia
            | EffectId::HoldingTorqueLevel
            | EffectId::PreslidingHysteresis
            | EffectId::Backlash
            | EffectId::MissedSteps
            | EffectId::TorqueOffset
            | EffectId::TorqueGain
            | EffectId::SensorDelay
            | EffectId::EncoderEccentricity => {}
        }
    }

    /// Whether anything is left that changes within a cycle.
    pub fn within_a_cycle(&self) -> bool {
        self.follows_the_contact()
            || self.angle.is_some()
            || self.flow.is_some()
            || self.position.is_some()
            || self.lag.is_there()
            || self.coupling.is_there()
            || self.detent.is_some()
            || self.microstep.is_some()
            || self.customs.is_there()
    }

    /// Whether anything but friction loads the spool.
    pub fn loads_the_spool(&self) -> bool {
        self.flow.is_some()
            || self.position.is_some()
            || self.pressure_torque_nm_per_mpa != 0.0
            || self.customs.loads()
    }

    /// Whether friction depends on the contact's past: rests or distance.
    pub fn follows_the_contact(&self) -> bool {
        self.dwell.gain != 0.0 || self.lock.gain != 0.0 || self.wear_gain != 0.0 || self.customs.remembers()
    }

    /// What scales friction at a pressure drop (Pa) and an oil temperature (°C), the angle's part left out.
    pub fn levels(&self, pressure_drop_pa: f64, oil_temperature_c: f64, contact: &Contact) -> Levels {
        let pressure_mpa = pressure_drop_pa.abs() / PA_PER_MPA;
        let warmer_k = oil_temperature_c - self.reference_temperature_c;
        let mut level = 1.0;
        if self.pressure_gain != 0.0 {
            let at = |mpa: f64| 1.0 + self.pressure_gain * mpa.powf(self.pressure_exponent);
            level = at(pressure_mpa) / at(self.nominal_pressure_mpa);
        }
        if self.friction_beta_per_k != 0.0 {
            level *= (1.0 + self.friction_beta_per_k * warmer_k).max(LEAST_LEVEL);
        }
        if self.follows_the_contact() {
            level *= 1.0 + pressure_mpa * self.lock.after(contact.rest_s);
            level *= 1.0 - self.wear_gain * (-contact.distance_rad * self.per_wear_distance).exp_m1();
        }
        let viscous = if self.viscosity_beta_per_k == 0.0 {
            1.0
        } else {
            (-self.viscosity_beta_per_k * warmer_k).exp()
        };
        Levels {
            level,
            level_per_rad: 0.0,
            static_factor: 1.0 + self.dwell.after(contact.rest_s),
            viscous,
            asymmetry: self.asymmetry,
            viscous_asymmetry: self.viscous_asymmetry,
        }
    }

    /// `levels` with the angle's part, and what users' formulas and tables make of it `time_s` after `held` began.
    #[inline]
    pub fn levels_at(&self, levels: &Levels, held: &Held, moving: Moving, time_s: f64) -> Levels {
        let levels = self.levels_by_series(levels, moving.angle);
        if !self.customs.scales() {
            return levels;
        }
        let Moving { angle, speed, acceleration } = moving;
        self.customs.scaled(levels, &held.at(angle, speed, acceleration, time_s))
    }

    #[inline]
    fn levels_by_series(&self, levels: &Levels, angle: f64) -> Levels {
        let Some(series) = &self.angle else { return *levels };
        let (value, slope) = series.at(angle);
        let factor = 1.0 + value;
        if factor < LEAST_LEVEL {
            return Levels { level: levels.level * LEAST_LEVEL, ..*levels };
        }
        Levels { level: levels.level * factor, level_per_rad: levels.level * slope, ..*levels }
    }

    /// The other torques at a pressure drop (Pa), those of users' formulas and tables left out.
    pub fn other_torque(&self, pressure_drop_pa: f64) -> OtherTorque<'_> {
        let pressure_mpa = pressure_drop_pa / PA_PER_MPA;
        OtherTorque {
            constant_nm: self.pressure_torque_nm_per_mpa * pressure_mpa,
            position: self.position.as_ref(),
            flow: self.flow.as_ref().map(|flow| (flow, pressure_mpa)),
        }
    }
}

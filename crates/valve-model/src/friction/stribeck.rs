//! Static Stribeck friction: T = g(ω)·tanh(ω/ω_r) + σ2·ω with g(ω) = T_c + (T_s − T_c)·exp(−|ω/ω_s|^δ).
//!
//! Regularised near zero: within a few ω_r the torque rises through zero instead of jumping, so the law creeps where
//! a real contact sticks, at ω ≈ ω_r·T/T_s under a load T below T_s.

use serde::{Deserialize, Serialize};

use super::curve::{Curve, Levels};
use super::law::{Flow, Law, Linearised, Point, sign};
use super::maxwell::Memory;
use super::validate_curve;
use crate::ParamError;
use crate::error::{not_negative, positive};

/// `[friction]` with `law = "stribeck"`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StribeckParams {
    /// Coulomb torque T_c, N·m.
    pub coulomb_torque_nm: f64,
    /// Static torque T_s, N·m.
    pub static_torque_nm: f64,
    /// Stribeck velocity ω_s, rad/s.
    pub stribeck_velocity_rad_per_s: f64,
    /// Stribeck exponent δ.
    pub stribeck_exponent: f64,
    /// Viscous coefficient σ2, N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
    /// Regularisation velocity ω_r, rad/s.
    pub regularisation_velocity_rad_per_s: f64,
}

impl StribeckParams {
    /// Checks the section.
    ///
    /// # Errors
    /// The first number that the law forbids.
    pub fn validate(&self) -> Result<(), ParamError> {
        validate_curve(
            self.coulomb_torque_nm,
            self.static_torque_nm,
            self.stribeck_velocity_rad_per_s,
            self.stribeck_exponent,
        )?;
        not_negative("viscous_nm_s_per_rad", self.viscous_nm_s_per_rad)?;
        positive("regularisation_velocity_rad_per_s", self.regularisation_velocity_rad_per_s)
    }
}

/// The law with its coefficients prepared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct StribeckLaw {
    curve: Curve,
    per_regularisation_velocity: f64,
}

impl StribeckLaw {
    pub fn new(params: &StribeckParams) -> Self {
        let curve = Curve::new(
            params.coulomb_torque_nm,
            params.static_torque_nm,
            params.stribeck_velocity_rad_per_s,
            params.stribeck_exponent,
            params.viscous_nm_s_per_rad,
        );
        Self { curve, per_regularisation_velocity: 1.0 / params.regularisation_velocity_rad_per_s }
    }
}

impl Law for StribeckLaw {
    fn flow(&self, at: Point, levels: &Levels, memory: &Memory) -> Flow {
        Flow { torque_nm: self.torque(at, 0.0, levels, memory), rate: 0.0 }
    }

    fn linearise(&self, at: Point, levels: &Levels, _memory: &Memory) -> Linearised {
        let point = self.curve.at(at.curve_speed, at.direction, levels);
        let direction = (at.speed * self.per_regularisation_velocity).tanh();
        Linearised {
            flow: Flow { torque_nm: point.torque_nm * direction + point.viscous * at.curve_speed, rate: 0.0 },
            torque_by_speed: point.torque_nm
                * (1.0 - direction * direction)
                * self.per_regularisation_velocity,
            torque_by_curve_speed: point.slope * direction + point.viscous,
            torque_by_level: point.torque_nm * direction / levels.level,
            ..Linearised::default()
        }
    }

    fn frozen(&self, at: Point, _dt_s: f64, _levels: &Levels, _memory: &Memory) -> f64 {
        at.z
    }

    fn torque(&self, at: Point, _rate: f64, levels: &Levels, _memory: &Memory) -> f64 {
        let point = self.curve.at(at.curve_speed, at.direction, levels);
        let direction = (at.speed * self.per_regularisation_velocity).tanh();
        point.torque_nm * direction + point.viscous * at.curve_speed
    }

    fn steady_nm(&self, speed: f64, levels: &Levels) -> f64 {
        self.torque(
            Point { speed, curve_speed: speed, z: 0.0, direction: sign(speed) },
            0.0,
            levels,
            &Memory::default(),
        )
    }

    fn curve(&self) -> &Curve {
        &self.curve
    }

    /// None, and no damping: within the regularisation the torque at rest is a matter of creep, which no rig shows.
    fn stiffness(&self) -> f64 {
        0.0
    }
}

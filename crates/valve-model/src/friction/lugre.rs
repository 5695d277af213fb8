//! LuGre friction: T = σ0·z + σ1·dz/dt + σ2·ω, dz/dt = ω − σ0·|ω|·z/g(ω), g(ω) = T_c + (T_s − T_c)·exp(−|ω/ω_s|^δ).
//!
//! Equation (2) of the paper, with the modulus of ω and the exponent inside the exponential.

use serde::{Deserialize, Serialize};

use super::curve::{Curve, Levels};
use super::law::{Flow, Law, Linearised, Point};
use super::maxwell::Memory;
use super::validate_curve;
use crate::ParamError;
use crate::error::{not_negative, positive};

/// `[friction]` with `law = "lugre"`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LuGreParams {
    /// Coulomb torque T_c, N·m.
    pub coulomb_torque_nm: f64,
    /// Static torque T_s, N·m.
    pub static_torque_nm: f64,
    /// Stribeck velocity ω_s, rad/s.
    pub stribeck_velocity_rad_per_s: f64,
    /// Stribeck exponent δ.
    pub stribeck_exponent: f64,
    /// Bristle stiffness σ0, N·m/rad.
    pub bristle_stiffness_nm_per_rad: f64,
    /// Bristle damping σ1, N·m·s/rad.
    pub bristle_damping_nm_s_per_rad: f64,
    /// Viscous coefficient σ2, N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
}

impl LuGreParams {
    /// The least σ2 at which the law is passive for any motion, σ1·(T_s − T_c)/T_c in N·m·s/rad; below it fast starts
    /// can give out energy (Barahona and Canudas de Wit, LuGre friction model: passivity).
    pub fn passive_viscous_nm_s_per_rad(&self) -> f64 {
        let excess_nm = self.static_torque_nm - self.coulomb_torque_nm;
        self.bristle_damping_nm_s_per_rad * excess_nm / self.coulomb_torque_nm
    }

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
        positive("bristle_stiffness_nm_per_rad", self.bristle_stiffness_nm_per_rad)?;
        not_negative("bristle_damping_nm_s_per_rad", self.bristle_damping_nm_s_per_rad)?;
        not_negative("viscous_nm_s_per_rad", self.viscous_nm_s_per_rad)
    }
}

/// The law with its coefficients prepared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct LuGreLaw {
    curve: Curve,
    stiffness: f64,
    damping: f64,
}

impl LuGreLaw {
    pub fn new(params: &LuGreParams) -> Self {
        let curve = Curve::new(
            params.coulomb_torque_nm,
            params.static_torque_nm,
            params.stribeck_velocity_rad_per_s,
            params.stribeck_exponent,
            params.viscous_nm_s_per_rad,
        );
        Self {
            curve,
            stiffness: params.bristle_stiffness_nm_per_rad,
            damping: params.bristle_damping_nm_s_per_rad,
        }
    }
}

impl Law for LuGreLaw {
    #[inline]
    fn flow(&self, at: Point, levels: &Levels, _memory: &Memory) -> Flow {
        let point = self.curve.at(at.curve_speed, at.direction, levels);
        let spring_nm = self.stiffness * at.z;
        let rate = at.speed - at.speed * at.direction * spring_nm / point.torque_nm;
        Flow { torque_nm: spring_nm + self.damping * rate + point.viscous * at.curve_speed, rate }
    }

    #[inline]
    fn linearise(&self, at: Point, levels: &Levels, _memory: &Memory) -> Linearised {
        let direction = at.direction;
        let point = self.curve.at(at.curve_speed, direction, levels);
        let per_curve = 1.0 / point.torque_nm;
        let spring_nm = self.stiffness * at.z;
        let decay = at.speed * at.direction * per_curve;
        let rate = at.speed - decay * spring_nm;
        let rate_by_speed = 1.0 - direction * spring_nm * per_curve;
        let rate_by_curve_speed = decay * spring_nm * per_curve * point.slope;
        let rate_by_z = -decay * self.stiffness;
        let rate_by_level = decay * spring_nm / levels.level;
        Linearised {
            flow: Flow { torque_nm: spring_nm + self.damping * rate + point.viscous * at.curve_speed, rate },
            torque_by_speed: self.damping * rate_by_speed,
            torque_by_curve_speed: self.damping * rate_by_curve_speed + point.viscous,
            torque_by_z: self.stiffness + self.damping * rate_by_z,
            torque_by_level: self.damping * rate_by_level,
            rate_by_speed,
            rate_by_curve_speed,
            rate_by_z,
            rate_by_level,
        }
    }

    fn frozen(&self, at: Point, dt_s: f64, levels: &Levels, _memory: &Memory) -> f64 {
        let direction = at.direction;
        let point = self.curve.at(at.curve_speed, direction, levels);
        let steady = direction * point.torque_nm / self.stiffness;
        // Towards the steady value by expm1: at creep speeds the difference is far below z itself.
        let travel = at.speed * at.direction * dt_s * self.stiffness / point.torque_nm;
        at.z + (at.z - steady) * (-travel).exp_m1()
    }

    fn torque(&self, at: Point, rate: f64, levels: &Levels, _memory: &Memory) -> f64 {
        let point = self.curve.at(at.curve_speed, at.direction, levels);
        self.stiffness * at.z + self.damping * rate + point.viscous * at.curve_speed
    }

    fn curve(&self) -> &Curve {
        &self.curve
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }

    fn damping(&self) -> f64 {
        self.damping
    }
}

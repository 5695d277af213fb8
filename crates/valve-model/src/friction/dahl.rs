//! Dahl friction: dF/dθ = σ0·|1 − sgn(ω)·F/T_c|^i·sgn(1 − sgn(ω)·F/T_c), plus σ2·ω.
//!
//! Equation (1) of the paper, with the exponent i and the modulus that it lacks.

use serde::{Deserialize, Serialize};

use super::curve::{Curve, Levels};
use super::law::{Flow, Law, Linearised, Point};
use super::maxwell::Memory;
use crate::ParamError;
use crate::error::{not_negative, positive};

/// `[friction]` with `law = "dahl"`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DahlParams {
    /// Coulomb torque T_c, N·m.
    pub coulomb_torque_nm: f64,
    /// Stiffness σ0 at rest, N·m/rad.
    pub bristle_stiffness_nm_per_rad: f64,
    /// Viscous coefficient σ2, N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
    /// Dahl's exponent i: 1 for most, below for brittle, above for ductile contacts.
    pub dahl_exponent: f64,
}

impl DahlParams {
    /// Checks the section.
    ///
    /// # Errors
    /// The first number that the law forbids.
    pub fn validate(&self) -> Result<(), ParamError> {
        positive("coulomb_torque_nm", self.coulomb_torque_nm)?;
        positive("bristle_stiffness_nm_per_rad", self.bristle_stiffness_nm_per_rad)?;
        not_negative("viscous_nm_s_per_rad", self.viscous_nm_s_per_rad)?;
        positive("dahl_exponent", self.dahl_exponent)
    }
}

/// The law with its coefficients prepared; z = F/σ0 without the viscous part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct DahlLaw {
    curve: Curve,
    stiffness: f64,
    exponent: f64,
}

impl DahlLaw {
    pub fn new(params: &DahlParams) -> Self {
        Self {
            curve: Curve::flat(params.coulomb_torque_nm, params.viscous_nm_s_per_rad),
            stiffness: params.bristle_stiffness_nm_per_rad,
            exponent: params.dahl_exponent,
        }
    }

    /// |x|^i·sgn x of the distance x to the steady torque, and its derivative by x.
    fn power(&self, distance: f64) -> (f64, f64) {
        if self.exponent == 1.0 {
            return (distance, 1.0);
        }
        // Below exponent 1 the slope is infinite at the steady state; the bound touches linearisations alone.
        let size = distance.abs();
        let slope = self.exponent * size.max(1e-6).powf(self.exponent - 1.0);
        (size.powf(self.exponent).copysign(distance), slope)
    }
}

impl Law for DahlLaw {
    fn flow(&self, at: Point, levels: &Levels, _memory: &Memory) -> Flow {
        let direction = at.direction;
        let point = self.curve.at(at.curve_speed, direction, levels);
        let (power, _) = self.power(1.0 - direction * self.stiffness * at.z / point.torque_nm);
        Flow { torque_nm: self.stiffness * at.z + point.viscous * at.curve_speed, rate: at.speed * power }
    }

    fn linearise(&self, at: Point, levels: &Levels, _memory: &Memory) -> Linearised {
        let direction = at.direction;
        let point = self.curve.at(at.curve_speed, direction, levels);
        let reached = direction * self.stiffness * at.z / point.torque_nm;
        let (power, slope) = self.power(1.0 - reached);
        Linearised {
            flow: Flow {
                torque_nm: self.stiffness * at.z + point.viscous * at.curve_speed,
                rate: at.speed * power,
            },
            torque_by_curve_speed: point.viscous,
            torque_by_z: self.stiffness,
            rate_by_speed: power,
            rate_by_z: -at.speed * at.direction * slope * self.stiffness / point.torque_nm,
            rate_by_level: at.speed * slope * reached / levels.level,
            ..Linearised::default()
        }
    }

    /// d|x|/ds = −(σ0/T_c)·|x|^i over the distance s travelled: an exponential for i = 1, else a power law that for
    /// i < 1 reaches zero.
    fn frozen(&self, at: Point, dt_s: f64, levels: &Levels, _memory: &Memory) -> f64 {
        let direction = at.direction;
        let point = self.curve.at(at.curve_speed, direction, levels);
        let steady = direction * point.torque_nm / self.stiffness;
        let travel = at.speed * at.direction * dt_s * self.stiffness / point.torque_nm;
        let distance = 1.0 - at.z / steady;
        let size = if self.exponent == 1.0 {
            distance.abs() * (-travel).exp()
        } else if distance == 0.0 {
            0.0
        } else {
            let rest = 1.0 - self.exponent;
            let base = distance.abs().powf(rest) - rest * travel;
            if base > 0.0 { base.powf(1.0 / rest) } else { 0.0 }
        };
        steady * (1.0 - size.copysign(distance))
    }

    fn torque(&self, at: Point, _rate: f64, levels: &Levels, _memory: &Memory) -> f64 {
        let point = self.curve.at(at.curve_speed, at.direction, levels);
        self.stiffness * at.z + point.viscous * at.curve_speed
    }

    fn curve(&self) -> &Curve {
        &self.curve
    }

    fn stiffness(&self) -> f64 {
        self.stiffness
    }
}

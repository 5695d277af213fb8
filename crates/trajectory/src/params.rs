//! What the trajectory is set to, checked once.

use serde::{Deserialize, Serialize};
use signals::MAX_ANGLE_RAD;
use thiserror::Error;
use valve_model::OrificeParams;

/// Limits of motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// The lowest angle, rad; `None`: without a limit.
    pub min_angle_rad: Option<f64>,
    /// The highest angle, rad; `None`: without a limit.
    pub max_angle_rad: Option<f64>,
    /// The highest speed in both directions, rad/s.
    pub max_speed_rad_per_s: f64,
    /// The highest acceleration in both directions, rad/s².
    pub max_acceleration_rad_per_s2: f64,
    /// The highest jerk in both directions, rad/s³.
    pub max_jerk_rad_per_s3: f64,
    /// The highest speed of a valve that is not homed, rad/s.
    pub unhomed_speed_rad_per_s: f64,
}

impl Limits {
    /// What holds while no angle means anything: slow jogging, wherever it leads.
    pub(crate) fn unhomed(self) -> Self {
        Self {
            min_angle_rad: None,
            max_angle_rad: None,
            max_speed_rad_per_s: self.unhomed_speed_rad_per_s,
            ..self
        }
    }
}

/// Everything that the trajectory needs to know of valve and machine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Params {
    /// Length of a cycle, s.
    pub period_s: f64,
    /// Limits of motion.
    pub limits: Limits,
    /// The orifice, where openings and flows are to be understood.
    pub orifice: Option<OrificeParams>,
    /// Density of the oil, kg/m³, where flows are to be understood.
    pub oil_density_kg_per_m3: Option<f64>,
}

/// A parameter that no trajectory can be made with.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TrajectoryError {
    /// A number is out of its range.
    #[error("`{key}` is {found}, expected {expected}")]
    OutOfRange {
        /// The field's name.
        key: &'static str,
        /// The value found.
        found: f64,
        /// What would have been accepted.
        expected: &'static str,
    },
    /// The orifice is none.
    #[error(transparent)]
    Orifice(#[from] valve_model::ParamError),
}

fn require(
    accepted: bool,
    key: &'static str,
    found: f64,
    expected: &'static str,
) -> Result<(), TrajectoryError> {
    if accepted { Ok(()) } else { Err(TrajectoryError::OutOfRange { key, found, expected }) }
}

impl Params {
    /// Checks all numbers.
    ///
    /// # Errors
    /// The first one that is out of its range, NaN included.
    pub fn validate(&self) -> Result<(), TrajectoryError> {
        let limits = &self.limits;
        // The bounds are those of the Reference that these numbers end up in.
        let positive = [
            ("period_s", self.period_s, 10.0, "a number above 0, at most 10"),
            ("max_speed_rad_per_s", limits.max_speed_rad_per_s, 1e6, "a number above 0, at most 1e6"),
            (
                "max_acceleration_rad_per_s2",
                limits.max_acceleration_rad_per_s2,
                1e9,
                "a number above 0, at most 1e9",
            ),
            ("max_jerk_rad_per_s3", limits.max_jerk_rad_per_s3, 1e12, "a number above 0, at most 1e12"),
        ];
        for (key, found, highest, expected) in positive {
            require(found > 0.0 && found <= highest, key, found, expected)?;
        }
        let angles = [("min_angle_rad", limits.min_angle_rad), ("max_angle_rad", limits.max_angle_rad)];
        for (key, found) in angles {
            let found = found.unwrap_or(0.0);
            require(found.abs() <= MAX_ANGLE_RAD, key, found, "an angle within ±6.3e9")?;
        }
        if let (Some(lowest), Some(highest)) = (limits.min_angle_rad, limits.max_angle_rad) {
            require(lowest < highest, "max_angle_rad", highest, "more than `min_angle_rad`")?;
        }
        if let Some(orifice) = &self.orifice {
            orifice.validate()?;
        }
        if let Some(density) = self.oil_density_kg_per_m3 {
            let accepted = density > 0.0 && density.is_finite();
            require(accepted, "oil_density_kg_per_m3", density, "a finite number above 0")?;
        }
        Ok(())
    }
}

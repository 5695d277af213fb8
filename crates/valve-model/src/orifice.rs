//! The orifice: Q = C_d·A(θ)·sqrt(2Δp/ρ), its window opening with the spool's angle.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::error::{finite, positive, require};
use crate::{ParamError, Window};

/// `[orifice]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrificeParams {
    /// Discharge coefficient C_d, dimensionless, above 0, at most 1.
    pub discharge_coefficient: f64,
    /// The fully open window, m².
    pub window_area_m2: f64,
    /// Spool angle at which the window is just closed, rad.
    pub closed_angle_rad: f64,
    /// Spool angle at which the window is fully open, rad; above the closed angle, by less than a turn.
    pub open_angle_rad: f64,
    /// How the window opens between the two.
    #[serde(default)]
    pub window: Window,
}

/// Why no angle gives a flow.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum OrificeError {
    /// The flow asked for is more than the open window passes at this pressure drop.
    #[error("{:.4} L/min asked for, at most {:.4} L/min at this pressure drop", asked_m3_per_s * 6e4, most_m3_per_s * 6e4)]
    TooMuch {
        /// Asked for, m³/s.
        asked_m3_per_s: f64,
        /// With the window open, m³/s, signed as the pressure drop.
        most_m3_per_s: f64,
    },
    /// The flow asked for runs against the pressure drop.
    #[error("{:.4} L/min asked for against a pressure drop of {:.4} MPa", asked_m3_per_s * 6e4, pressure_drop_pa / 1e6)]
    AgainstPressure {
        /// Asked for, m³/s.
        asked_m3_per_s: f64,
        /// The pressure drop, Pa.
        pressure_drop_pa: f64,
    },
    /// A number that is not finite, or a density that is not above zero.
    #[error(
        "flow {asked_m3_per_s} m³/s, pressure drop {pressure_drop_pa} Pa, density {density_kg_per_m3} kg/m³: expected finite numbers"
    )]
    NotANumber {
        /// Asked for, m³/s.
        asked_m3_per_s: f64,
        /// The pressure drop, Pa.
        pressure_drop_pa: f64,
        /// The density, kg/m³.
        density_kg_per_m3: f64,
    },
}

impl OrificeParams {
    /// Which part of the window's area is open at a spool angle: 0 at the closed angle and below, 1 at the open angle
    /// and above, in between as the window's shape has it.
    pub fn opening(&self, angle_rad: f64) -> f64 {
        let travel_rad = self.open_angle_rad - self.closed_angle_rad;
        self.window.area((angle_rad - self.closed_angle_rad) / travel_rad)
    }

    /// The spool angle of an opening; 0 and below give the closed angle, 1 and above the open one.
    pub fn angle_for_opening(&self, opening: f64) -> f64 {
        let travel_rad = self.open_angle_rad - self.closed_angle_rad;
        self.closed_angle_rad + travel_rad * self.window.way(opening)
    }

    /// Q = C_d·A(θ)·sqrt(2·|Δp|/ρ) in m³/s, with the sign of the pressure drop.
    pub fn flow_m3_per_s(&self, angle_rad: f64, pressure_drop_pa: f64, density_kg_per_m3: f64) -> f64 {
        self.opening(angle_rad) * self.open_flow_m3_per_s(pressure_drop_pa, density_kg_per_m3)
    }

    /// The spool angle that gives a flow; the closed angle for no flow, whatever the pressure drop.
    ///
    /// # Errors
    /// A flow beyond the open window's, or against the pressure drop.
    pub fn angle_for_flow(
        &self,
        flow_m3_per_s: f64,
        pressure_drop_pa: f64,
        density_kg_per_m3: f64,
    ) -> Result<f64, OrificeError> {
        let most_m3_per_s = self.open_flow_m3_per_s(pressure_drop_pa, density_kg_per_m3);
        if !flow_m3_per_s.is_finite() || !most_m3_per_s.is_finite() {
            return Err(OrificeError::NotANumber {
                asked_m3_per_s: flow_m3_per_s,
                pressure_drop_pa,
                density_kg_per_m3,
            });
        }
        if flow_m3_per_s == 0.0 {
            return Ok(self.closed_angle_rad);
        }
        if flow_m3_per_s * pressure_drop_pa < 0.0 {
            return Err(OrificeError::AgainstPressure { asked_m3_per_s: flow_m3_per_s, pressure_drop_pa });
        }
        if flow_m3_per_s.abs() > most_m3_per_s.abs() {
            return Err(OrificeError::TooMuch { asked_m3_per_s: flow_m3_per_s, most_m3_per_s });
        }
        Ok(self.angle_for_opening(flow_m3_per_s / most_m3_per_s))
    }

    fn open_flow_m3_per_s(&self, pressure_drop_pa: f64, density_kg_per_m3: f64) -> f64 {
        let speed_m_per_s = (2.0 * pressure_drop_pa.abs() / density_kg_per_m3).sqrt();
        self.discharge_coefficient * self.window_area_m2 * speed_m_per_s.copysign(pressure_drop_pa)
    }

    /// Checks the section.
    ///
    /// # Errors
    /// The first number that no orifice can have.
    pub fn validate(&self) -> Result<(), ParamError> {
        let coefficient = self.discharge_coefficient;
        require(
            coefficient > 0.0 && coefficient <= 1.0,
            "discharge_coefficient",
            coefficient,
            "a number above 0, at most 1",
        )?;
        positive("window_area_m2", self.window_area_m2)?;
        finite("closed_angle_rad", self.closed_angle_rad)?;
        let travel_rad = self.open_angle_rad - self.closed_angle_rad;
        require(
            travel_rad > 0.0 && travel_rad < std::f64::consts::TAU,
            "open_angle_rad",
            self.open_angle_rad,
            "an angle above `closed_angle_rad`, by less than a turn",
        )
    }
}

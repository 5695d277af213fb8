//! Viscous friction by design calculation: the oil sheared in the clearance between spool and sleeve, laminar Couette
//! flow (the paper's equations 4 to 6).
//!
//! σ2 = μ·R²·A/δ with the clearance δ = R_sleeve − R_spool (5) and the sheared area A = 2π·R·(L − n·w) − 2·A_opening (6);
//! μ in Pa·s, lengths in m, areas in m², σ2 in N·m·s/rad. Valid for δ ≪ R, spool and sleeve concentric. The paper's
//! Table 1 calls diameters what equation (5) uses as radii.

use serde::{Deserialize, Serialize};

use crate::error::{not_negative, positive, require};
use crate::{OilParams, ParamError};

/// `[clearance]`: stands in place of `viscous_nm_s_per_rad`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClearanceParams {
    /// External radius R of the spool, m.
    pub spool_radius_m: f64,
    /// Inner radius of the sleeve, m.
    pub sleeve_radius_m: f64,
    /// Length L of the spool inside the sleeve, m.
    pub length_m: f64,
    /// Number n of balancing grooves.
    pub grooves: u32,
    /// Width w of a groove, m.
    pub groove_width_m: f64,
    /// Area of one of the two throttling orifices in the spool, m².
    pub opening_area_m2: f64,
}

impl ClearanceParams {
    /// The clearance δ, m (5).
    pub fn clearance_m(&self) -> f64 {
        self.sleeve_radius_m - self.spool_radius_m
    }

    /// The sheared area A, m² (6).
    pub fn area_m2(&self) -> f64 {
        let smooth_m = self.length_m - f64::from(self.grooves) * self.groove_width_m;
        std::f64::consts::TAU * self.spool_radius_m * smooth_m - 2.0 * self.opening_area_m2
    }

    /// The viscous coefficient σ2 at the oil's reference temperature, N·m·s/rad (4).
    pub fn viscous_nm_s_per_rad(&self, oil: &OilParams) -> f64 {
        let radius_m = self.spool_radius_m;
        oil.dynamic_viscosity_pa_s() * radius_m * radius_m * self.area_m2() / self.clearance_m()
    }

    /// Checks the section.
    ///
    /// # Errors
    /// The first number that no spool can have; openings and grooves that leave no area.
    pub fn validate(&self) -> Result<(), ParamError> {
        positive("spool_radius_m", self.spool_radius_m)?;
        require(
            self.sleeve_radius_m > self.spool_radius_m,
            "sleeve_radius_m",
            self.sleeve_radius_m,
            "a radius above `spool_radius_m`",
        )?;
        positive("length_m", self.length_m)?;
        not_negative("groove_width_m", self.groove_width_m)?;
        not_negative("opening_area_m2", self.opening_area_m2)?;
        require(
            self.area_m2() > 0.0,
            "length_m",
            self.length_m,
            "a length that grooves and openings leave an area of",
        )
    }
}

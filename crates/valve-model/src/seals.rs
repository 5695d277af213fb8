//! Coulomb and static torque by design calculation: O-rings with back-up rings on the spool (the paper's equations 7
//! to 12).
//!
//! T_c = μ_w·F_t·R (7) with the normal force F_t = 2π·R·b·p_w (8), the seal width b = b_o + b_b (10) of O-ring,
//! b_o = √(π·d_2²/4) (9), and back-up ring, times the number of seals; T_s = c·T_c (12). μ_w = 0.027 at 20 MPa (11) and
//! c = 1.2 at 0.05 to 0.3 m/s are the paper's, for PTFE back-up rings at high pressure and low speed.

use serde::{Deserialize, Serialize};

use crate::ParamError;
use crate::error::{count, not_negative, positive, require};

/// `[seals]`: stands in place of `coulomb_torque_nm` and `static_torque_nm`, which then hold at the working pressure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SealParams {
    /// Radius R of the spool where the seals run, m.
    pub spool_radius_m: f64,
    /// Number of seals, each an O-ring with its back-up ring.
    pub seals: u32,
    /// Cross-section diameter d_2 of the O-ring, m.
    pub o_ring_diameter_m: f64,
    /// Width b_b of the back-up ring, m; 0 without one.
    pub backup_ring_width_m: f64,
    /// Working pressure p_w across the seal, Pa.
    pub working_pressure_pa: f64,
    /// Friction coefficient μ_w at that pressure.
    pub friction_coefficient: f64,
    /// c = T_s/T_c.
    pub static_ratio: f64,
}

impl SealParams {
    /// The paper's μ_w at 20 MPa (11).
    pub const FRICTION_COEFFICIENT_AT_20_MPA: f64 = 2.7e-2;
    /// The paper's c (12).
    pub const STATIC_RATIO: f64 = 1.2;

    /// Compressed width b of one seal, m (9), (10).
    pub fn seal_width_m(&self) -> f64 {
        let diameter_m = self.o_ring_diameter_m;
        (std::f64::consts::FRAC_PI_4 * diameter_m * diameter_m).sqrt() + self.backup_ring_width_m
    }

    /// Normal force F_t of all seals together, N (8).
    pub fn normal_force_n(&self) -> f64 {
        let width_m = f64::from(self.seals) * self.seal_width_m();
        std::f64::consts::TAU * self.spool_radius_m * width_m * self.working_pressure_pa
    }

    /// Coulomb torque T_c, N·m (7).
    pub fn coulomb_torque_nm(&self) -> f64 {
        self.friction_coefficient * self.normal_force_n() * self.spool_radius_m
    }

    /// Static torque T_s, N·m (12).
    pub fn static_torque_nm(&self) -> f64 {
        self.static_ratio * self.coulomb_torque_nm()
    }

    /// Checks the section.
    ///
    /// # Errors
    /// The first number that no seal can have.
    pub fn validate(&self) -> Result<(), ParamError> {
        positive("spool_radius_m", self.spool_radius_m)?;
        count("seals", self.seals, 1..=100, "1 to 100 seals")?;
        positive("o_ring_diameter_m", self.o_ring_diameter_m)?;
        not_negative("backup_ring_width_m", self.backup_ring_width_m)?;
        positive("working_pressure_pa", self.working_pressure_pa)?;
        positive("friction_coefficient", self.friction_coefficient)?;
        let ratio = self.static_ratio;
        require(ratio >= 1.0, "static_ratio", ratio, "a finite number, 1 or above")
    }
}

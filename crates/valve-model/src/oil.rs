//! The oil: density for the orifice, viscosity for the clearance, and the temperature at which both hold.

use serde::{Deserialize, Serialize};

use crate::ParamError;
use crate::error::{positive, require};

/// `[oil]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OilParams {
    /// Density ρ, kg/m³.
    pub density_kg_per_m3: f64,
    /// Kinematic viscosity ν at the reference temperature, m²/s (1 cSt = 1e-6 m²/s).
    pub kinematic_viscosity_m2_per_s: f64,
    /// The temperature at which the model's numbers hold, °C.
    pub reference_temperature_c: f64,
}

impl OilParams {
    /// The reference temperature of a model without `[oil]`, °C.
    pub const DEFAULT_REFERENCE_TEMPERATURE_C: f64 = 40.0;

    /// Dynamic viscosity μ = ν·ρ, Pa·s.
    pub fn dynamic_viscosity_pa_s(&self) -> f64 {
        self.kinematic_viscosity_m2_per_s * self.density_kg_per_m3
    }

    /// Checks the section.
    ///
    /// # Errors
    /// A density or viscosity that is not above zero, a temperature below absolute zero.
    pub fn validate(&self) -> Result<(), ParamError> {
        positive("density_kg_per_m3", self.density_kg_per_m3)?;
        positive("kinematic_viscosity_m2_per_s", self.kinematic_viscosity_m2_per_s)?;
        let temperature = self.reference_temperature_c;
        require(
            temperature > -273.15,
            "reference_temperature_c",
            temperature,
            "a temperature above -273.15 °C",
        )
    }
}

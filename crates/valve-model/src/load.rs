//! The load: what turns with the rotor on the far side of the torque transducer.

use serde::{Deserialize, Serialize};

use crate::ParamError;
use crate::error::not_negative;

/// `[load]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadParams {
    /// Inertia of spool and coupling, kg·m².
    pub inertia_kg_m2: f64,
}

impl LoadParams {
    /// Checks the section.
    ///
    /// # Errors
    /// A negative or non-finite inertia.
    pub fn validate(&self) -> Result<(), ParamError> {
        not_negative("inertia_kg_m2", self.inertia_kg_m2)
    }
}

//! The friction laws and what they share.

mod contact;
mod curve;
mod dahl;
mod driven;
mod lag;
mod law;
mod leuven;
mod lugre;
mod maxwell;
mod parts;
mod prepared;
mod state;
mod stribeck;

use serde::{Deserialize, Serialize};

pub use dahl::DahlParams;
pub use leuven::LeuvenParams;
pub use lugre::LuGreParams;
pub use prepared::FrictionLaw;
pub use state::{ContactPast, FrictionState};
pub use stribeck::StribeckParams;

pub(crate) use contact::Contact;
pub(crate) use curve::Levels;
pub(crate) use driven::Sweep;
pub(crate) use lag::{Lag, Lagging, Pivots};
pub(crate) use law::{Law, Linearised, Point, sign};
pub(crate) use maxwell::Memory;
pub(crate) use prepared::AnyLaw;

use crate::ParamError;
use crate::error::{positive, require};

/// `[friction]`: the law (key `law`, the variant's name in lower case) and its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FrictionParams {
    /// A static curve, regularised near zero speed.
    Stribeck(StribeckParams),
    /// Presliding hysteresis with a local memory, no Stribeck effect.
    Dahl(DahlParams),
    /// Bristles: presliding, Stribeck curve, frictional lag.
    LuGre(LuGreParams),
    /// LuGre with Maxwell-slip hysteresis: non-local memory.
    Leuven(LeuvenParams),
}

impl FrictionParams {
    /// The law's name as the model file spells it.
    pub fn law(&self) -> &'static str {
        match self {
            Self::Stribeck(_) => "stribeck",
            Self::Dahl(_) => "dahl",
            Self::LuGre(_) => "lugre",
            Self::Leuven(_) => "leuven",
        }
    }

    /// Friction torque in N·m at a speed (rad/s) held for ever: sgn(ω)·g(ω) + σ2·ω, zero at rest.
    pub fn steady_torque(&self, speed_rad_per_s: f64) -> f64 {
        FrictionLaw::new(self).steady_torque(speed_rad_per_s)
    }

    /// Sets T_c and T_s, N·m; a law without a Stribeck effect has no T_s.
    pub fn set_levels(&mut self, coulomb_nm: f64, static_nm: f64) {
        *self.coulomb_mut() = coulomb_nm;
        if let Some(torque_nm) = self.static_mut() {
            *torque_nm = static_nm;
        }
    }

    /// T_c, N·m.
    pub fn coulomb_torque_nm(&self) -> f64 {
        *self.clone().coulomb_mut()
    }

    /// σ2, N·m·s/rad.
    pub fn viscous_nm_s_per_rad(&self) -> f64 {
        *self.clone().viscous_mut()
    }

    /// Sets σ2, N·m·s/rad.
    pub fn set_viscous(&mut self, viscous_nm_s_per_rad: f64) {
        *self.viscous_mut() = viscous_nm_s_per_rad;
    }

    /// Checks the section.
    ///
    /// # Errors
    /// The first number that the law forbids.
    pub fn validate(&self) -> Result<(), ParamError> {
        match self {
            Self::Stribeck(params) => params.validate(),
            Self::Dahl(params) => params.validate(),
            Self::LuGre(params) => params.validate(),
            Self::Leuven(params) => params.validate(),
        }
    }
}

/// Checks the four numbers of a Stribeck curve g(ω) = T_c + (T_s − T_c)·exp(−|ω/ω_s|^exponent).
fn validate_curve(
    coulomb_torque_nm: f64,
    static_torque_nm: f64,
    stribeck_velocity_rad_per_s: f64,
    stribeck_exponent: f64,
) -> Result<(), ParamError> {
    positive("coulomb_torque_nm", coulomb_torque_nm)?;
    require(
        static_torque_nm >= coulomb_torque_nm,
        "static_torque_nm",
        static_torque_nm,
        "a finite number, `coulomb_torque_nm` or above",
    )?;
    positive("stribeck_velocity_rad_per_s", stribeck_velocity_rad_per_s)?;
    positive("stribeck_exponent", stribeck_exponent)
}

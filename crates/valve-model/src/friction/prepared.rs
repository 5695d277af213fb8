//! A friction law with its coefficients prepared, whichever law it is.

use serde::{Deserialize, Serialize};

use super::FrictionParams;
use super::curve::Levels;
use super::dahl::DahlLaw;
use super::law::{Law, Point, sign};
use super::leuven::LeuvenLaw;
use super::lugre::LuGreLaw;
use super::maxwell::Memory;
use super::stribeck::StribeckLaw;

/// The laws.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum AnyLaw {
    Stribeck(StribeckLaw),
    Dahl(DahlLaw),
    LuGre(LuGreLaw),
    Leuven(LeuvenLaw),
}

impl AnyLaw {
    /// The law, where how fast it is called doesn't matter.
    fn as_law(&self) -> &dyn Law {
        match self {
            Self::Stribeck(law) => law,
            Self::Dahl(law) => law,
            Self::LuGre(law) => law,
            Self::Leuven(law) => law,
        }
    }
}

/// A friction law ready to run: [`FrictionParams`] with every reciprocal taken. Plain data, for a controller to keep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FrictionLaw {
    pub(crate) law: AnyLaw,
}

impl FrictionLaw {
    /// Prepares validated parameters.
    pub fn new(params: &FrictionParams) -> Self {
        let law = match params {
            FrictionParams::Stribeck(params) => AnyLaw::Stribeck(StribeckLaw::new(params)),
            FrictionParams::Dahl(params) => AnyLaw::Dahl(DahlLaw::new(params)),
            FrictionParams::LuGre(params) => AnyLaw::LuGre(LuGreLaw::new(params)),
            FrictionParams::Leuven(params) => AnyLaw::Leuven(LeuvenLaw::new(params)),
        };
        Self { law }
    }

    /// Friction torque in N·m at a speed (rad/s) held for ever, zero at rest.
    pub fn steady_torque(&self, speed_rad_per_s: f64) -> f64 {
        self.law.as_law().steady_nm(speed_rad_per_s, &Levels::NOMINAL)
    }

    /// Stiffness of the bristles, N·m/rad; 0 for a law without.
    pub fn bristle_stiffness_nm_per_rad(&self) -> f64 {
        self.law.as_law().stiffness()
    }

    /// Damping of the bristles, N·m·s/rad; 0 for a law without.
    pub fn bristle_damping_nm_s_per_rad(&self) -> f64 {
        self.law.as_law().damping()
    }

    /// The greatest deflection that a bristle has in steady motion, where it carries T_s, rad; 0 for a law without bristles.
    pub fn break_away_deflection_rad(&self) -> f64 {
        self.deflection_rad(self.steady_torque(f64::MIN_POSITIVE))
    }

    /// The deflection at which a relaxed contact that is loaded carries a torque (N·m), rad; 0 for a law without bristles.
    pub fn deflection_rad(&self, torque_nm: f64) -> f64 {
        self.deflection_after_rad(0.0, torque_nm)
    }

    /// The deflection at which a contact that comes from another one (rad) carries a torque (N·m), rad. It is the same
    /// wherever it comes from but for Maxwell elements.
    pub fn deflection_after_rad(&self, came_from_rad: f64, torque_nm: f64) -> f64 {
        let mut before = Memory::default();
        self.remember_deflection(came_from_rad, &mut before);
        self.law.as_law().deflection_rad(torque_nm, &Levels::NOMINAL, &before)
    }

    /// Takes Maxwell elements along to a deflection, rad; the other laws have none.
    pub(super) fn remember_deflection(&self, deflection_rad: f64, memory: &mut Memory) {
        if let AnyLaw::Leuven(leuven) = &self.law {
            let direction = sign(deflection_rad);
            let at = Point { speed: 0.0, curve_speed: 0.0, z: deflection_rad, direction };
            leuven.remember(at, &Levels::NOMINAL, memory);
        }
    }

    /// Whether a contact remembers where its bristles came from.
    pub fn has_memory(&self) -> bool {
        matches!(self.law, AnyLaw::Leuven(_))
    }

    /// Over which slip a contact forgets that it rested: the deflection that carries the Coulomb torque, rad; for a law
    /// without bristles a fixed one of their order.
    pub(crate) fn slip_length_rad(&self) -> f64 {
        let per_rad = self.law.as_law().relative_stiffness_per_rad();
        if per_rad > 0.0 { 1.0 / per_rad } else { 1e-3 }
    }
}

//! A friction law's state: the bristles, and what the contact has been through.

use serde::{Deserialize, Serialize};

use super::contact::Contact;
use super::curve::Levels;
use super::law::{Law, Point, sign};
use super::maxwell::Memory;
use super::prepared::{AnyLaw, FrictionLaw};

/// The inner state of a friction law: plain data, zero for a relaxed contact.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct FrictionState {
    pub(crate) z: f64,
    pub(crate) memory: Memory,
    pub(crate) contact: Contact,
}

/// What a contact brings along from before a motion is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ContactPast {
    /// Mean bristle deflection z, rad.
    pub deflection_rad: f64,
    /// The deflection from which it came there, rad, which Maxwell elements remember; 0: they were relaxed.
    pub came_from_rad: f64,
    /// Time at rest, s.
    pub rest_s: f64,
    /// Distance travelled, rad.
    pub distance_rad: f64,
    /// The clock at the beginning of the motion, s.
    pub clock_s: f64,
}

impl FrictionState {
    /// A contact with a past, at a speed (rad/s) from which friction doesn't lag.
    pub fn after(law: &FrictionLaw, past: &ContactPast, speed_rad_per_s: f64) -> Self {
        let contact = Contact {
            curve_speed: speed_rad_per_s,
            stage_speed: speed_rad_per_s,
            rest_s: past.rest_s,
            distance_rad: past.distance_rad,
            clock_s: past.clock_s,
        };
        let mut state = Self { contact, ..Self::deflected(law, past.came_from_rad) };
        state.deflect(law, past.deflection_rad);
        state
    }

    /// The contact as the past of what follows; where Maxwell elements came from is not kept.
    pub fn past(&self) -> ContactPast {
        ContactPast {
            deflection_rad: self.z,
            came_from_rad: 0.0,
            rest_s: self.contact.rest_s,
            distance_rad: self.contact.distance_rad,
            clock_s: self.contact.clock_s,
        }
    }

    /// A bristle deflected by `z` rad, as after sliding; Maxwell elements stretched alike.
    pub fn deflected(law: &FrictionLaw, z_rad: f64) -> Self {
        let mut state = Self::default();
        state.deflect(law, z_rad);
        state
    }

    fn deflect(&mut self, law: &FrictionLaw, z_rad: f64) {
        self.z = z_rad;
        law.remember_deflection(z_rad, &mut self.memory);
    }

    /// Mean bristle deflection z, rad; 0 for the static law.
    pub fn bristle_deflection_rad(&self) -> f64 {
        self.z
    }

    /// The torque at one instant of a motion, N·m.
    pub(crate) fn torque(&self, law: &FrictionLaw, speed: f64, curve_speed: f64, levels: &Levels) -> f64 {
        let at = Point { speed, curve_speed, z: self.z, direction: sign(speed) };
        let flow = match &law.law {
            AnyLaw::Stribeck(law) => law.flow(at, levels, &self.memory),
            AnyLaw::Dahl(law) => law.flow(at, levels, &self.memory),
            AnyLaw::LuGre(law) => law.flow(at, levels, &self.memory),
            AnyLaw::Leuven(law) => law.flow(at, levels, &self.memory),
        };
        flow.torque_nm
    }
}

//! What changes the friction's structure.

use super::{Applied, Instance, applied, series};
use crate::contact::{Bank, Contact};
use crate::forms::{Growth, Thermal};
use crate::plan::RunPlan;
use serde_json::json;

impl Instance {
    pub(super) fn pressure_dependent_friction(&self, contact: &mut Contact) -> Applied {
        let gain = self.amount * self.between(0, 0.02, 0.05);
        let curvature = if self.own_form { 0.02 * self.sign } else { 0.0 };
        contact.pressure = Some((gain, curvature));
        applied(json!({ "gain": gain, "exponent": 1.0 }), !self.own_form)
    }

    pub(super) fn temperature_dependent_viscosity(&self, contact: &mut Contact) -> Applied {
        let beta = self.amount * self.between(0, 0.02, 0.04);
        let thermal = if self.own_form { Thermal::Vogel(beta) } else { Thermal::Exponential(beta) };
        contact.viscosity = Some(thermal);
        applied(json!({ "beta_per_k": beta }), !self.own_form)
    }

    pub(super) fn temperature_dependent_friction(&self, contact: &mut Contact) -> Applied {
        let beta = self.sign * (self.amount * self.between(0, 0.006, 0.012));
        let thermal = if self.own_form { Thermal::Exponential(-beta) } else { Thermal::Linear(beta) };
        contact.warmth = Some(thermal);
        applied(json!({ "beta_per_k": beta }), !self.own_form)
    }

    pub(super) fn angle_dependent_friction(&self, contact: &mut Contact) -> Applied {
        let wave = self.wave(self.between(0, 0.06, 0.15));
        let parameters = series(&wave);
        contact.angle = Some(wave);
        applied(parameters, !self.own_form)
    }

    pub(super) fn direction_asymmetry(&self, contact: &mut Contact) -> Applied {
        let level = self.sign * self.amount * self.between(0, 0.06, 0.15);
        let viscous = self.sign * self.amount * self.between(1, 0.0, 0.3);
        let within = contact.nominal.stribeck_rad_per_s * if self.own_form { 0.05 } else { 1e-9 };
        contact.asymmetry = Some((level, viscous, within));
        applied(json!({ "level": level, "viscous": viscous }), !self.own_form)
    }

    pub(super) fn dwell_stiction(&self, contact: &mut Contact) -> Applied {
        let growth = self.growth(self.between(0, 0.3, 0.8));
        contact.dwell = Some(growth);
        self.grown(growth)
    }

    pub(super) fn hydraulic_lock(&self, contact: &mut Contact) -> Applied {
        let growth = self.growth(self.between(0, 0.05, 0.12));
        contact.lock = Some(growth);
        self.grown(growth)
    }

    pub(super) fn friction_lag(&self, contact: &mut Contact) -> Applied {
        let lag_s = self.amount * self.between(0, 4e-3, 15e-3);
        contact.lag = Some((lag_s, self.own_form));
        applied(json!({ "time_constant_s": lag_s }), !self.own_form)
    }

    pub(super) fn presliding_hysteresis(&self, contact: &mut Contact) -> Applied {
        let sharpness = self.between(0, 2.0, 4.0);
        let (stiffness, torque) = (vec![0.4, 0.3, 0.2, 0.1], vec![0.15, 0.2, 0.3, 0.35]);
        contact.bank = Bank { stiffness, torque, sharpness };
        applied(json!({ "sharpness": sharpness }), false)
    }

    pub(super) fn wear_drift(&self, contact: &mut Contact, runs: &[RunPlan]) -> Applied {
        let gain = self.amount * self.sign * self.between(0, 0.1, 0.3);
        let distance = travelled_rad(runs) * self.between(1, 0.3, 1.5);
        contact.wear = Some((gain, distance, self.own_form));
        applied(json!({ "gain": gain, "distance_rad": distance }), !self.own_form)
    }

    fn growth(&self, gain: f64) -> Growth {
        let logarithmic = self.own_form;
        let gain = self.amount * gain * if logarithmic { 0.6 } else { 1.0 };
        Growth { gain, time_constant_s: self.between(1, 0.3, 1.0), logarithmic }
    }

    fn grown(&self, growth: Growth) -> Applied {
        let parameters =
            json!({ "gain": growth.gain, "time_constant_s": growth.time_constant_s, "exponent": 1.0 });
        applied(parameters, !self.own_form)
    }
}

/// The distance of all motions, rad.
fn travelled_rad(runs: &[RunPlan]) -> f64 {
    let one = |run: &RunPlan| -> f64 {
        run.times_s.windows(2).map(|t| (run.motion.at(t[1]).value - run.motion.at(t[0]).value).abs()).sum()
    };
    runs.iter().map(one).sum()
}

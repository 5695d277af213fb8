//! Hidden effects: how each changes the rig, and by which numbers.

mod friction;
mod measurement;
mod motor;
mod numbers;
mod outside;
mod torques;

use crate::effect::Effect;
use crate::forms::Wave;
use crate::hidden::Gap;
use crate::plan::RunPlan;
use crate::spool::Valve;
use rand::RngExt;
use rand_pcg::Pcg64;
use serde_json::{Map, Value, json};
use std::f64::consts::TAU;

/// An effect with its numbers drawn; `amount` scales it, 0 leaves the valve nominal.
#[derive(Debug, Clone)]
pub(crate) struct Instance {
    pub effect: Effect,
    pub amount: f64,
    /// Another functional form than the product's effect has, where that is open.
    pub own_form: bool,
    sign: f64,
    draws: [f64; 6],
}

/// What an effect was made of.
#[derive(Debug, Clone)]
pub(crate) struct Applied {
    pub parameters: Map<String, Value>,
    /// Whether these are the product's own parameters of the same form.
    pub same_form: bool,
}

/// Most harmonics of a wave, as many as are given as parameters.
const ORDERS: usize = 4;

impl Instance {
    pub fn draw(effect: Effect, rng: &mut Pcg64) -> Self {
        Self {
            effect,
            amount: 1.0,
            own_form: rng.random_bool(0.5),
            sign: if rng.random_bool(0.5) { 1.0 } else { -1.0 },
            draws: std::array::from_fn(|_| rng.random_range(0.0..1.0)),
        }
    }

    /// With given numbers, of the product's own form.
    pub fn given(effect: Effect, amount: f64, draws: [f64; 6]) -> Self {
        Self { effect, amount, own_form: false, sign: 1.0, draws }
    }

    /// Where the plan leaves out what separates twins, what separates them by itself is left out too: more inertia would look
    /// like a lag below zero, stiffer bristles like a coupling stiffer than rigid, and viscous friction that differs by
    /// direction like no offset.
    pub fn become_a_twin(&mut self, without: Option<Gap>) {
        match without {
            Some(Gap::OneFrequency | Gap::NoShake) => self.sign = -1.0,
            Some(Gap::SlidingOnly) => self.draws[1] = 0.0,
            _ => {}
        }
    }

    /// Whether a larger amount makes the residual larger in proportion, about.
    pub fn is_scalable(&self) -> bool {
        !matches!(self.effect, Effect::PreslidingHysteresis | Effect::MissedSteps)
    }

    fn between(&self, draw: usize, low: f64, high: f64) -> f64 {
        low + (high - low) * self.draws[draw]
    }

    /// A factor that is 1 at amount 0 and never below a quarter.
    fn factor(&self, change: f64) -> f64 {
        (self.sign * self.amount * change.ln_1p()).exp().clamp(0.25, 4.0)
    }

    fn wave(&self, size: f64) -> Wave {
        let size = self.amount * size;
        if self.own_form {
            return Wave::bump(1.6 * size * self.sign, TAU * self.draws[1], self.between(2, 0.8, 2.0));
        }
        let order = 1.0 + (3.0 * self.draws[1]).floor();
        Wave::Sines(vec![
            (order, size, TAU * self.draws[2]),
            (order + 1.0, 0.5 * size * self.draws[3], TAU * self.draws[4]),
        ])
    }

    /// Puts the effect into the valve.
    pub fn apply(&self, valve: &mut Valve, runs: &[RunPlan]) -> Applied {
        match self.effect {
            Effect::CoulombLevel => self.coulomb_level(&mut valve.contact.nominal),
            Effect::StaticLevel => self.static_level(&mut valve.contact.nominal),
            Effect::ViscousLevel => self.number((0.3, 0.8), &mut valve.contact.nominal.viscous_nm_s_per_rad),
            Effect::StribeckVelocity => {
                self.number((0.5, 1.2), &mut valve.contact.nominal.stribeck_rad_per_s)
            }
            Effect::BristleStiffness => {
                self.number((0.3, 0.6), &mut valve.contact.nominal.stiffness_nm_per_rad)
            }
            Effect::LoadInertia => self.number((0.3, 0.6), &mut valve.contact.nominal.load_kg_m2),
            Effect::HoldingTorqueLevel => self.holding_torque_level(&mut valve.contact.nominal),
            Effect::PressureDependentFriction => self.pressure_dependent_friction(&mut valve.contact),
            Effect::TemperatureDependentViscosity => self.temperature_dependent_viscosity(&mut valve.contact),
            Effect::TemperatureDependentFriction => self.temperature_dependent_friction(&mut valve.contact),
            Effect::AngleDependentFriction => self.angle_dependent_friction(&mut valve.contact),
            Effect::DirectionAsymmetry => self.direction_asymmetry(&mut valve.contact),
            Effect::DwellStiction => self.dwell_stiction(&mut valve.contact),
            Effect::HydraulicLock => self.hydraulic_lock(&mut valve.contact),
            Effect::FrictionLag => self.friction_lag(&mut valve.contact),
            Effect::PreslidingHysteresis => self.presliding_hysteresis(&mut valve.contact),
            Effect::WearDrift => self.wear_drift(&mut valve.contact, runs),
            Effect::FlowTorque => self.flow_torque(valve),
            Effect::PositionTorque => self.position_torque(valve),
            Effect::PressureTorque => self.pressure_torque(valve),
            Effect::CouplingCompliance => self.coupling_compliance(valve),
            Effect::DetentTorque => self.detent_torque(valve),
            Effect::MicrostepError => self.microstep_error(valve),
            Effect::Backlash => self.backlash(valve),
            Effect::MissedSteps => self.missed_steps(valve, runs),
            Effect::TorqueOffset => self.torque_offset(valve),
            Effect::TorqueGain => self.torque_gain(valve),
            Effect::SensorDelay => self.sensor_delay(valve),
            Effect::EncoderEccentricity => self.encoder_eccentricity(valve),
            Effect::OutsideSquareDrag => self.outside_square_drag(&mut valve.contact),
            Effect::OutsideHum => self.outside_hum(valve),
            Effect::OutsideGear => self.outside_gear(valve),
            Effect::OutsideWander => self.outside_wander(&mut valve.contact),
            Effect::OutsidePlay => self.outside_play(valve),
            Effect::OutsideLaw => self.outside_law(0, &mut valve.contact),
            Effect::OutsidePressureLaw => self.outside_law(1, &mut valve.contact),
            Effect::OutsideWarmthLaw => self.outside_law(2, &mut valve.contact),
            Effect::OutsideWarmPressureLaw => self.outside_law(3, &mut valve.contact),
        }
    }
}

fn applied(parameters: Value, same_form: bool) -> Applied {
    let parameters = if let Value::Object(map) = parameters { map } else { Map::new() };
    Applied { parameters, same_form }
}

fn series(wave: &Wave) -> Value {
    let (cos, sin) = wave.coefficients(ORDERS + 1);
    json!({ "cos": cos, "sin": sin })
}

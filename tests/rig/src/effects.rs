//! Hidden effects: how each changes the rig, and by which numbers.

use crate::contact::Bank;
use crate::forms::{Growth, Thermal, Wave};
use crate::hidden::Gap;
use crate::nominal::Nominal;
use crate::plan::RunPlan;
use crate::spool::Valve;
use rand::RngExt;
use rand_pcg::Pcg64;
use serde_json::{Map, Value, json};
use std::f64::consts::TAU;

/// An effect with its numbers drawn; `amount` scales it, 0 leaves the valve nominal.
#[derive(Debug, Clone)]
pub(crate) struct Instance {
    pub id: String,
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
    pub fn draw(id: &str, rng: &mut Pcg64) -> Self {
        Self {
            id: id.to_owned(),
            amount: 1.0,
            own_form: rng.random_bool(0.5),
            sign: if rng.random_bool(0.5) { 1.0 } else { -1.0 },
            draws: std::array::from_fn(|_| rng.random_range(0.0..1.0)),
        }
    }

    /// With given numbers, of the product's own form.
    pub fn given(id: &str, amount: f64, draws: [f64; 6]) -> Self {
        Self { id: id.to_owned(), amount, own_form: false, sign: 1.0, draws }
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
        !["presliding-hysteresis", "missed-steps"].contains(&self.id.as_str())
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
        let nominal = valve.contact.nominal;
        if let Some(applied) = self.parameter_off(&mut valve.contact.nominal, &nominal) {
            return applied;
        }
        self.structure(valve, &nominal, runs)
            .or_else(|| self.other_torque(valve, &nominal))
            .or_else(|| self.motor(valve, &nominal, runs))
            .or_else(|| self.measurement(valve, &nominal))
            .or_else(|| self.outside(valve, &nominal))
            .unwrap_or_else(|| panic!("the rig knows no effect {:?}", self.id))
    }

    fn parameter_off(&self, n: &mut Nominal, nominal: &Nominal) -> Option<Applied> {
        let mut factor = self.factor(self.between(0, 0.1, 0.3));
        match self.id.as_str() {
            "coulomb-level" => {
                n.coulomb_nm *= factor;
                n.static_nm *= factor;
            }
            "static-level" => {
                factor = factor.max(1.05 * nominal.coulomb_nm / nominal.static_nm);
                n.static_nm *= factor;
            }
            "viscous-level" => {
                factor = self.factor(self.between(0, 0.3, 0.8));
                n.viscous_nm_s_per_rad *= factor;
            }
            "stribeck-velocity" => {
                factor = self.factor(self.between(0, 0.5, 1.2));
                n.stribeck_rad_per_s *= factor;
            }
            "bristle-stiffness" => {
                factor = self.factor(self.between(0, 0.3, 0.6));
                n.stiffness_nm_per_rad *= factor;
            }
            "load-inertia" => {
                factor = self.factor(self.between(0, 0.3, 0.6));
                n.load_kg_m2 *= factor;
            }
            "holding-torque-level" => n.holding_nm *= factor,
            _ => return None,
        }
        Some(applied(json!({ "factor": factor }), true))
    }

    fn growth(&self, gain: f64) -> Growth {
        let logarithmic = self.own_form;
        let gain = self.amount * gain * if logarithmic { 0.6 } else { 1.0 };
        Growth { gain, time_constant_s: self.between(1, 0.3, 1.0), logarithmic }
    }

    fn structure(&self, valve: &mut Valve, n: &Nominal, runs: &[RunPlan]) -> Option<Applied> {
        let contact = &mut valve.contact;
        let beta = |high: f64| self.amount * self.between(0, 0.5 * high, high);
        Some(match self.id.as_str() {
            "pressure-dependent-friction" => {
                let gain = self.amount * self.between(0, 0.02, 0.05);
                let curvature = if self.own_form { 0.02 * self.sign } else { 0.0 };
                contact.pressure = Some((gain, curvature));
                applied(json!({ "gain": gain, "exponent": 1.0 }), !self.own_form)
            }
            "temperature-dependent-viscosity" => {
                let beta = beta(0.04);
                let thermal = if self.own_form { Thermal::Vogel(beta) } else { Thermal::Exponential(beta) };
                contact.viscosity = Some(thermal);
                applied(json!({ "beta_per_k": beta }), !self.own_form)
            }
            "temperature-dependent-friction" => {
                let beta = self.sign * beta(0.012);
                let thermal = if self.own_form { Thermal::Exponential(-beta) } else { Thermal::Linear(beta) };
                contact.warmth = Some(thermal);
                applied(json!({ "beta_per_k": beta }), !self.own_form)
            }
            "angle-dependent-friction" => {
                let wave = self.wave(self.between(0, 0.06, 0.15));
                let parameters = series(&wave);
                contact.angle = Some(wave);
                applied(parameters, !self.own_form)
            }
            "direction-asymmetry" => {
                let level = self.sign * self.amount * self.between(0, 0.06, 0.15);
                let viscous = self.sign * self.amount * self.between(1, 0.0, 0.3);
                let within = n.stribeck_rad_per_s * if self.own_form { 0.05 } else { 1e-9 };
                contact.asymmetry = Some((level, viscous, within));
                applied(json!({ "level": level, "viscous": viscous }), !self.own_form)
            }
            "dwell-stiction" => {
                let growth = self.growth(self.between(0, 0.3, 0.8));
                contact.dwell = Some(growth);
                let parameters = json!({ "gain": growth.gain, "time_constant_s": growth.time_constant_s, "exponent": 1.0 });
                applied(parameters, !self.own_form)
            }
            "hydraulic-lock" => {
                let growth = self.growth(self.between(0, 0.05, 0.12));
                contact.lock = Some(growth);
                let parameters = json!({ "gain": growth.gain, "time_constant_s": growth.time_constant_s, "exponent": 1.0 });
                applied(parameters, !self.own_form)
            }
            "friction-lag" => {
                let lag_s = self.amount * self.between(0, 4e-3, 15e-3);
                contact.lag = Some((lag_s, self.own_form));
                applied(json!({ "time_constant_s": lag_s }), !self.own_form)
            }
            "presliding-hysteresis" => {
                let sharpness = self.between(0, 2.0, 4.0);
                let (stiffness, torque) = (vec![0.4, 0.3, 0.2, 0.1], vec![0.15, 0.2, 0.3, 0.35]);
                contact.bank = Bank { stiffness, torque, sharpness };
                applied(json!({ "sharpness": sharpness }), false)
            }
            "wear-drift" => {
                let gain = self.amount * self.sign * self.between(0, 0.1, 0.3);
                let distance = travelled_rad(runs) * self.between(1, 0.3, 1.5);
                contact.wear = Some((gain, distance, self.own_form));
                applied(json!({ "gain": gain, "distance_rad": distance }), !self.own_form)
            }
            _ => return None,
        })
    }

    fn other_torque(&self, valve: &mut Valve, n: &Nominal) -> Option<Applied> {
        Some(match self.id.as_str() {
            "flow-torque" => {
                let wave = self.wave(self.between(0, 0.01, 0.02) * n.coulomb_nm);
                let parameters = series(&wave);
                valve.flow = Some(wave);
                applied(parameters, !self.own_form)
            }
            "position-torque" => {
                let wave = self.wave(self.between(0, 0.05, 0.12) * n.coulomb_nm);
                let parameters = series(&wave);
                valve.position = Some(wave);
                applied(parameters, !self.own_form)
            }
            "pressure-torque" => {
                valve.pressure_nm_per_mpa =
                    self.sign * self.amount * self.between(0, 0.01, 0.03) * n.coulomb_nm;
                applied(json!({ "gain": valve.pressure_nm_per_mpa }), true)
            }
            "coupling-compliance" => {
                let stiffness = n.stiffness_nm_per_rad * self.between(0, 1.5, 3.0) / self.amount.max(1e-9);
                // Enough that the falling friction curve doesn't make the spool squeal.
                let damping = self.between(1, 1.5, 3.0) * n.drive_of_a_squeal();
                valve.coupling = (self.amount > 0.0).then_some((stiffness, damping));
                let parameters =
                    json!({ "stiffness_nm_per_rad": stiffness, "damping_nm_s_per_rad": damping });
                applied(parameters, true)
            }
            _ => return None,
        })
    }

    fn motor(&self, valve: &mut Valve, n: &Nominal, runs: &[RunPlan]) -> Option<Applied> {
        Some(match self.id.as_str() {
            "detent-torque" => {
                let size = self.amount * self.between(0, 0.02, 0.06) * n.holding_nm;
                let wave = Wave::Sines(vec![(1.0, size, TAU * self.draws[1])]);
                let parameters = series(&wave);
                valve.detent = Some(wave);
                applied(parameters, true)
            }
            "microstep-error" => {
                let size = self.amount * self.between(0, 1e-4, 4e-4);
                let order = 1.0 + (4.0 * self.draws[3]).floor();
                let wave = Wave::Sines(vec![
                    (order, size, TAU * self.draws[1]),
                    (order + 1.0, 0.5 * size, TAU * self.draws[2]),
                ]);
                let parameters = series(&wave);
                valve.microstep = Some(wave);
                applied(parameters, true)
            }
            "backlash" => {
                valve.backlash_rad = self.amount * self.between(0, 5e-4, 2e-3);
                applied(json!({ "half_width_rad": valve.backlash_rad }), true)
            }
            "missed-steps" => {
                // In the middle of a run's motion, past the middle of the log.
                let mut moving: Vec<&RunPlan> =
                    runs.iter().filter(|run| run.kind == "constant-speed").collect();
                if moving.is_empty() {
                    moving = runs.iter().collect();
                }
                let run = moving[(self.draws[0] * moving.len() as f64) as usize];
                let at_s = run.times_s[0] + self.between(1, 0.3, 0.6) * (run.end_s() - run.times_s[0]);
                let teeth = self.sign * if self.draws[2] < 0.7 { 1.0 } else { 2.0 };
                valve.missed = vec![(run.clock_s + at_s, teeth)];
                applied(json!({ "run": run.name, "time_s": at_s - run.times_s[0], "teeth": teeth }), false)
            }
            _ => return None,
        })
    }

    fn measurement(&self, valve: &mut Valve, n: &Nominal) -> Option<Applied> {
        Some(match self.id.as_str() {
            "torque-offset" => {
                valve.offset_nm = self.sign * self.amount * self.between(0, 0.04, 0.12) * n.coulomb_nm;
                applied(json!({ "offset_nm": valve.offset_nm }), true)
            }
            "torque-gain" => {
                valve.gain = self.factor(self.between(0, 0.06, 0.15));
                applied(json!({ "factor": valve.gain }), true)
            }
            "sensor-delay" => {
                valve.delay_s = self.amount * self.between(0, 1.5e-3, 4e-3);
                applied(json!({ "delay_s": valve.delay_s }), true)
            }
            "encoder-eccentricity" => {
                valve.eccentricity = (self.amount * self.between(0, 3e-4, 2e-3), TAU * self.draws[1]);
                let (amplitude, phase) = valve.eccentricity;
                applied(json!({ "amplitude_rad": amplitude, "phase_rad": phase }), true)
            }
            _ => return None,
        })
    }

    fn outside(&self, valve: &mut Valve, n: &Nominal) -> Option<Applied> {
        let size = self.amount * self.between(0, 0.05, 0.12) * n.coulomb_nm;
        match self.id.as_str() {
            "outside-square-drag" => {
                valve.contact.square_drag = 2.0 * size / n.fastest_rad_per_s.powi(2);
            }
            // Of the torque, or of the angle where there is none.
            "outside-hum" => valve.hum = Some((size, self.between(1, 11.0, 53.0))),
            "outside-gear" => valve.gear = Some((size, self.between(1, 2.3, 2.7), TAU * self.draws[2])),
            "outside-wander" => {
                let part = 0.7 * size / n.coulomb_nm;
                valve.contact.wander = vec![
                    (part, self.between(1, 0.35, 0.5), TAU * self.draws[2]),
                    (part, self.between(3, 0.8, 1.1), TAU * self.draws[4]),
                ];
            }
            "outside-play" => valve.transducer_play_nm = size,
            _ => return None,
        }
        Some(applied(json!({}), false))
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

/// The distance of all motions, rad.
fn travelled_rad(runs: &[RunPlan]) -> f64 {
    let one = |run: &RunPlan| -> f64 {
        run.times_s.windows(2).map(|t| (run.motion.at(t[1]).value - run.motion.at(t[0]).value).abs()).sum()
    };
    runs.iter().map(one).sum()
}

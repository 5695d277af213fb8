//! The rig's friction: bristles (one, or a bank of Maxwell elements that slip one after the other), ageing at rest,
//! wear with distance, and a lag.
//!
//! T = Σ F_i + σ1·Ḟ/σ0 + σ2·v, dF_i/dt = k_i·ω·(1 − sgn(ω)·x_i·|x_i|^(m−1)), x_i = F_i/(α_i·g(v)); v is ω, or ω late.
//! With one element and m = 1 that is LuGre's law. Ageing: dA/dt = 1 − |slip|·A/D, D = T_c/σ0 (Dieterich's law).

use crate::forms::{Growth, Thermal, Wave};
use crate::law::{ActsOn, Law};
use crate::nominal::Nominal;
use crate::surroundings::Surroundings;

/// Most Maxwell elements.
const ELEMENTS: usize = 4;
/// Most states of a contact: elements, age, distance, two stages of a lag.
pub(crate) const MOST_STATES: usize = ELEMENTS + 4;

/// Elements that slip one after the other: parts of the stiffness and of the torque, and how sharply.
#[derive(Debug, Clone)]
pub(crate) struct Bank {
    pub stiffness: Vec<f64>,
    pub torque: Vec<f64>,
    pub sharpness: f64,
}

/// Everything that friction depends on.
#[derive(Debug, Clone)]
pub(crate) struct Contact {
    pub nominal: Nominal,
    pub bank: Bank,
    /// Gain (1/MPa) and curvature (1/MPa).
    pub pressure: Option<(f64, f64)>,
    pub viscosity: Option<Thermal>,
    pub warmth: Option<Thermal>,
    pub angle: Option<Wave>,
    /// Of the levels, of the viscous part, and the speed within which it changes sign.
    pub asymmetry: Option<(f64, f64, f64)>,
    pub dwell: Option<Growth>,
    pub lock: Option<Growth>,
    /// τ, and whether the lag has two stages.
    pub lag: Option<(f64, bool)>,
    /// Gain, distance, and whether it approaches its end hyperbolically.
    pub wear: Option<(f64, f64, bool)>,
    /// Outside the list: N·m·s²/rad² of a drag that grows with the square of the speed.
    pub square_drag: f64,
    /// Outside the list: the levels wander with time: parts and periods (s).
    pub wander: Vec<(f64, f64, f64)>,
    /// Outside the list: a drawn law.
    pub law: Option<Law>,
}

struct Curve {
    torque_nm: f64,
    viscous: f64,
}

impl Contact {
    pub fn new(nominal: Nominal) -> Self {
        Self {
            nominal,
            bank: Bank { stiffness: vec![1.0], torque: vec![1.0], sharpness: 1.0 },
            pressure: None,
            viscosity: None,
            warmth: None,
            angle: None,
            asymmetry: None,
            dwell: None,
            lock: None,
            lag: None,
            wear: None,
            square_drag: 0.0,
            wander: Vec::new(),
            law: None,
        }
    }

    fn ages(&self) -> bool {
        self.dwell.is_some() || self.lock.is_some()
    }

    fn lag_stages(&self) -> usize {
        self.lag.map_or(0, |(_, two)| if two { 2 } else { 1 })
    }

    /// The integrator's absolute tolerances.
    pub fn tolerances(&self) -> Vec<f64> {
        let mut all = vec![1e-7 * self.nominal.coulomb_nm; self.bank.torque.len()];
        all.extend(self.ages().then_some(1e-7));
        all.extend(self.wear.map(|_| 1e-6));
        all.extend(vec![1e-7 * self.nominal.stribeck_rad_per_s; self.lag_stages()]);
        all
    }

    fn levels(&self, at: &Surroundings, age_s: f64, distance_rad: f64) -> (f64, f64, f64) {
        let (mut level, mut held, mut viscous) = (1.0, 1.0, 1.0);
        if let Some((gain, curvature)) = self.pressure {
            let p = at.pressure_mpa.abs();
            level *= 1.0 + gain * p * (1.0 + curvature * p);
        }
        if let Some(thermal) = &self.viscosity {
            viscous *= thermal.factor(at.celsius, self.nominal.reference_c);
        }
        if let Some(thermal) = &self.warmth {
            level *= thermal.factor(at.celsius, self.nominal.reference_c);
        }
        if let Some(wave) = &self.angle {
            level *= 1.0 + wave.at(at.angle_rad);
        }
        if let Some(growth) = &self.dwell {
            held += growth.after(age_s);
        }
        if let Some(growth) = &self.lock {
            level *= 1.0 + at.pressure_mpa.abs() * growth.after(age_s);
        }
        if let Some((gain, distance, hyperbolic)) = self.wear {
            let x = distance_rad / distance;
            level *= 1.0 + gain * if hyperbolic { x / (1.0 + x) } else { 1.0 - (-x).exp() };
        }
        for (part, period, phase) in &self.wander {
            level *= 1.0 + part * (std::f64::consts::TAU * at.clock_s / period + phase).sin();
        }
        if let Some(law) = &self.law {
            level *= (1.0 + law.at(ActsOn::Levels, at)).max(0.01);
            viscous *= (1.0 + law.at(ActsOn::Viscous, at)).max(0.0);
        }
        (level, held, viscous)
    }

    fn curve(&self, at: &Surroundings, speed: f64, age_s: f64, distance_rad: f64) -> Curve {
        let (level, held, mut viscous) = self.levels(at, age_s, distance_rad);
        let n = &self.nominal;
        let fall = (-(speed / n.stribeck_rad_per_s).abs().powf(n.exponent)).exp();
        let mut torque_nm = level * (n.coulomb_nm + (n.static_nm * held - n.coulomb_nm).max(0.0) * fall);
        if let Some((levels, drag, within)) = self.asymmetry {
            let way = (at.speed_rad_per_s / within).tanh();
            torque_nm *= 1.0 + levels * way;
            viscous *= 1.0 + drag * way;
        }
        Curve { torque_nm, viscous: viscous * n.viscous_nm_s_per_rad }
    }

    /// How much more torque the bristles take for more angle, from the rates of their states at a speed.
    pub fn slope_nm_per_rad(&self, rates: &[f64], speed_rad_per_s: f64) -> f64 {
        if speed_rad_per_s.abs() < 1e-6 {
            return self.nominal.stiffness_nm_per_rad;
        }
        let sum: f64 = rates[..self.bank.torque.len()].iter().sum();
        (sum / speed_rad_per_s).clamp(0.0, self.nominal.stiffness_nm_per_rad)
    }

    /// Friction torque, and the rates of the states.
    pub fn torque(&self, states: &[f64], at: &Surroundings, rates: &mut [f64]) -> f64 {
        let n = &self.nominal;
        let elements = self.bank.torque.len();
        let mut next = elements;
        let mut take = |there: bool| {
            next += usize::from(there);
            if there { states[next - 1] } else { 0.0 }
        };
        let age_s = take(self.ages());
        let distance_rad = take(self.wear.is_some());
        let speed = at.speed_rad_per_s;
        let curve_speed = match self.lag_stages() {
            0 => speed,
            stages => {
                states[elements + usize::from(self.ages()) + usize::from(self.wear.is_some()) + stages - 1]
            }
        };
        let curve = self.curve(at, curve_speed, age_s, distance_rad);
        let (mut spring_nm, mut spring_rate) = (0.0, 0.0);
        for i in 0..elements {
            let reached = states[i] / (self.bank.torque[i] * curve.torque_nm);
            let power = if self.bank.sharpness == 1.0 {
                reached
            } else {
                reached.abs().powf(self.bank.sharpness).copysign(reached)
            };
            rates[i] = n.stiffness_nm_per_rad * self.bank.stiffness[i] * (speed - speed.abs() * power);
            spring_nm += states[i];
            spring_rate += rates[i];
        }
        let bristle_rate = spring_rate / n.stiffness_nm_per_rad;
        let mut put = elements;
        if self.ages() {
            let slip = (speed - bristle_rate).abs();
            rates[put] = 1.0 - slip * age_s * n.stiffness_nm_per_rad / n.coulomb_nm;
            put += 1;
        }
        if self.wear.is_some() {
            rates[put] = speed.abs();
            put += 1;
        }
        if let Some((lag_s, _)) = self.lag {
            let stages = self.lag_stages();
            let mut ahead = speed;
            for state in put..put + stages {
                rates[state] = (ahead - states[state]) * stages as f64 / lag_s;
                ahead = states[state];
            }
        }
        spring_nm
            + n.damping_nm_s_per_rad * bristle_rate
            + curve.viscous * curve_speed
            + self.square_drag * speed * speed.abs()
            + self.law.as_ref().map_or(0.0, |law| law.at(ActsOn::Torque, at))
    }
}

//! The friction torque's peak at the start against the ramp of speed, and what a parameter set means for slow motion.
//!
//! In a start with the acceleration α the bristles break away while the speed passes the Stribeck curve: T_s is reached
//! only while the speed at break-away, √(2αT_s/σ0), is below ω_s, that is for α below about ω_s²σ0/2T_s. Far above it the
//! bristles' damping, σ1·ω before they slip, makes a peak of its own that grows with √α and says nothing about T_s.

use super::{Candidate, Fact};
use anyhow::Result;
use serde_json::{Value, json};
use valve_model::{FrictionLaw, FrictionParams, FrictionState, ValveInput, ValveParams, ValveState, step};

/// Accelerations, rad/s²: so many in a decade, from 10^-3 on.
const PER_DECADE: u32 = 4;
const DECADES: u32 = 7;
const STEPS: u32 = 20_000;
/// A slow motion, rad/s, and how long it is watched, s; the first half is left to settle.
const SLOW_RAD_PER_S: f64 = 0.02;
const SLOW_S: f64 = 8.0;
const PERIOD_S: f64 = 1e-3;

/// A parameter set's peaks.
pub struct Ramps {
    pub name: &'static str,
    /// Acceleration (rad/s²) and peak of the friction torque (N·m).
    pub peaks: Vec<(f64, f64)>,
    /// ω_s²σ0/2T_s, rad/s².
    pub bound_rad_per_s2: f64,
    pub static_nm: f64,
    /// Peak to peak of the lag behind a slow command, rad; NaN where the motor can't turn it.
    pub stick_slip_rad: f64,
}

/// The peaks of a parameter set, by its law alone, and its slow motion, by the motor.
pub fn ramps(candidate: &Candidate) -> Result<Ramps> {
    let FrictionParams::LuGre(friction) = &candidate.model.friction else {
        anyhow::bail!("{}: not LuGre", candidate.name);
    };
    let (static_nm, stiffness) = (friction.static_torque_nm, friction.bristle_stiffness_nm_per_rad);
    let velocity = friction.stribeck_velocity_rad_per_s;
    let law = FrictionLaw::new(&candidate.model.friction);
    let accelerations =
        (0..=PER_DECADE * DECADES).map(|k| 1e-3 * 10f64.powf(f64::from(k) / f64::from(PER_DECADE)));
    let peaks = accelerations
        .map(|acceleration| (acceleration, peak_nm(&law, acceleration, 10.0 * static_nm / stiffness)));
    Ok(Ramps {
        name: candidate.name,
        peaks: peaks.collect(),
        bound_rad_per_s2: velocity * velocity * stiffness / (2.0 * static_nm),
        static_nm,
        stick_slip_rad: stick_slip_rad(candidate)?,
    })
}

/// The largest friction torque on the first `travel_rad` of a start.
fn peak_nm(law: &FrictionLaw, acceleration: f64, travel_rad: f64) -> f64 {
    let duration_s = (2.0 * travel_rad / acceleration).sqrt();
    let mut state = FrictionState::default();
    let speed = |k: u32| acceleration * duration_s * f64::from(k) / f64::from(STEPS);
    let dt_s = duration_s / f64::from(STEPS);
    (0..STEPS).map(|k| state.step(law, speed(k), speed(k + 1), dt_s)).fold(0.0, f64::max)
}

fn stick_slip_rad(candidate: &Candidate) -> Result<f64> {
    let params = ValveParams::new(&candidate.model)?;
    let mut state = ValveState::at_rest(0.0);
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for k in 0..(SLOW_S / PERIOD_S) as u32 {
        let (begin, end) =
            (SLOW_RAD_PER_S * f64::from(k) * PERIOD_S, SLOW_RAD_PER_S * f64::from(k + 1) * PERIOD_S);
        let input = ValveInput {
            command_start_rad: begin,
            command_end_rad: end,
            pressure_drop_pa: 0.0,
            oil_temperature_c: candidate.model.reference_temperature_c(),
            current_ratio: 1.0,
        };
        step(&params, &mut state, &input, PERIOD_S);
        if f64::from(k) * PERIOD_S > 0.5 * SLOW_S {
            least = least.min(end - state.angle_rad);
            most = most.max(end - state.angle_rad);
        }
    }
    let turned = state.angle_rad > 0.5 * SLOW_RAD_PER_S * SLOW_S && most < std::f64::consts::TAU / 50.0;
    Ok(if turned { most - least } else { f64::NAN })
}

impl Ramps {
    /// The fastest ramp up to which every peak is within 5 % of T_s, rad/s²; NaN where not even the slowest is.
    fn fastest_to_static(&self) -> f64 {
        let reached = self.peaks.iter().take_while(|(_, peak)| *peak > 0.95 * self.static_nm);
        reached.last().map_or(f64::NAN, |(acceleration, _)| *acceleration)
    }

    pub fn facts(&self) -> Vec<Fact> {
        let fact = |what: &str, value: f64, unit: &'static str, text: &str| Fact {
            group: "Starts and slow motion",
            id: format!("{what}_{}", self.name),
            text: format!("{}: {text}", self.name),
            value,
            unit,
            stated: None,
        };
        let bound = "ω_s²σ0/2T_s, above which a start does not reach T_s";
        let mut facts = vec![fact("ramp_bound", self.bound_rad_per_s2, "rad/s²", bound)];
        let fastest = self.fastest_to_static();
        if fastest.is_finite() {
            let text = "the fastest ramp up to which every peak is within 5 % of T_s";
            facts.push(fact("ramp_to_static", fastest, "rad/s²", text));
        }
        facts.push(fact(
            "peak_slowest",
            self.peaks.first().map_or(f64::NAN, |slowest| slowest.1),
            "N·m",
            "peak of friction in a start at 0.001 rad/s²",
        ));
        for wanted in [1.0, 100.0, 1000.0] {
            let nearest =
                self.peaks.iter().find(|(acceleration, _)| (acceleration / wanted - 1.0).abs() < 1e-6);
            if let Some((acceleration, peak)) = nearest {
                let text = format!("peak of friction in a start at {acceleration:.0} rad/s²");
                facts.push(fact(&format!("peak_at_{wanted}"), *peak, "N·m", &text));
            }
        }
        if self.stick_slip_rad.is_finite() {
            facts.push(fact(
                "stick_slip",
                self.stick_slip_rad,
                "rad",
                "peak to peak of the lag behind a command of 0.02 rad/s",
            ));
        }
        facts
    }

    pub fn to_json(&self) -> Value {
        let (accelerations, peaks): (Vec<f64>, Vec<f64>) = self.peaks.iter().copied().unzip();
        json!({
            "model": self.name, "acceleration_rad_per_s2": accelerations, "peak_nm": peaks, "static_torque_nm": self.static_nm,
            "bound_rad_per_s2": self.bound_rad_per_s2,
            "stick_slip_peak_to_peak_rad": self.stick_slip_rad.is_finite().then_some(self.stick_slip_rad),
        })
    }
}

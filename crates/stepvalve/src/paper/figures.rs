//! Figures 7, 10, 11 and 12: friction under a sine of speed, and torque when the motor turns at a pulse rate.

use super::{Candidate, Fact};
use anyhow::Result;
use serde_json::{Value, json};
use std::f64::consts::TAU;
use valve_model::{FrictionLaw, FrictionState, ValveInput, ValveParams, ValveState, step};

const PERIOD_S: f64 = 1e-3;
/// The paper's sine has a frequency, 1 Hz, and no amplitude: ours, rad/s.
const SINE_RAD_PER_S: f64 = 1.0;
const SINE_S: f64 = 2.0;
/// The paper's starts have no ramp: ours, pulses/s².
const RAMP_HZ_PER_S: f64 = 10e6;
const ROTATION_S: f64 = 1.0;
/// The mean is taken from here on, s.
const SETTLED_S: f64 = 0.5;
/// What the paper measured.
const STATED_MEAN_NM: f64 = 1.5;
const STATED_PEAK_NM: f64 = 3.0;

/// Friction under a sine of speed.
pub struct Sine {
    pub name: &'static str,
    pub time_s: Vec<f64>,
    pub speed_rad_per_s: Vec<f64>,
    pub torque_nm: Vec<f64>,
}

/// A rotation driven by the motor.
pub struct Rotation {
    pub name: &'static str,
    pub pulse_rate_hz: f64,
    pub time_s: Vec<f64>,
    pub speed_rad_per_s: Vec<f64>,
    pub friction_nm: Vec<f64>,
    /// Whether the rotor followed the command.
    pub follows: bool,
    pub mean_nm: f64,
    pub peak_nm: f64,
}

/// Figures 7 and 12: the law alone.
pub fn sine(candidate: &Candidate) -> Result<Sine> {
    let law = FrictionLaw::new(&candidate.model.friction);
    let mut state = FrictionState::default();
    let speed = |k: u32| SINE_RAD_PER_S * (TAU * f64::from(k) * PERIOD_S).sin();
    let mut found = Sine { name: candidate.name, time_s: vec![], speed_rad_per_s: vec![], torque_nm: vec![] };
    for k in 0..(SINE_S / PERIOD_S) as u32 {
        found.torque_nm.push(state.step(&law, speed(k), speed(k + 1), PERIOD_S));
        found.time_s.push(f64::from(k + 1) * PERIOD_S);
        found.speed_rad_per_s.push(speed(k + 1));
    }
    Ok(found)
}

/// Figures 10 and 11: the motor turns the valve from rest.
pub fn rotation(candidate: &Candidate, pulse_rate_hz: f64) -> Result<Rotation> {
    let params = ValveParams::new(&candidate.model)?;
    let microstep_rad = candidate.model.motor.map_or(0.0, |motor| motor.microstep_angle_rad());
    let (rate, ramp) = (pulse_rate_hz * microstep_rad, RAMP_HZ_PER_S * microstep_rad);
    let command = |time_s: f64| {
        let ramp_s = rate / ramp;
        if time_s < ramp_s { 0.5 * ramp * time_s * time_s } else { rate * (time_s - 0.5 * ramp_s) }
    };
    let mut state = ValveState::at_rest(0.0);
    let (mut time_s, mut speed_rad_per_s, mut friction_nm) = (vec![], vec![], vec![]);
    let mut peak_nm: f64 = 0.0;
    for k in 0..(ROTATION_S / PERIOD_S) as u32 {
        let (begin_s, end_s) = (f64::from(k) * PERIOD_S, f64::from(k + 1) * PERIOD_S);
        // Ten pieces, so that the peak is not missed between samples.
        let mut torque = 0.0;
        for piece in 0..10 {
            let at = |piece: u32| command(begin_s + (end_s - begin_s) * f64::from(piece) / 10.0);
            let input = ValveInput {
                command_start_rad: at(piece),
                command_end_rad: at(piece + 1),
                pressure_drop_pa: 0.0,
                oil_temperature_c: candidate.model.reference_temperature_c(),
                current_ratio: 1.0,
            };
            torque = step(&params, &mut state, &input, 0.1 * PERIOD_S).friction_torque_nm;
            peak_nm = peak_nm.max(torque.abs());
        }
        time_s.push(end_s);
        speed_rad_per_s.push(state.speed_rad_per_s);
        friction_nm.push(torque);
    }
    let settled = friction_nm.iter().skip((SETTLED_S / PERIOD_S) as usize);
    let mean_nm = settled.clone().sum::<f64>() / settled.count() as f64;
    let lag_rad = command(ROTATION_S) - state.angle_rad;
    let follows = lag_rad.abs() < TAU / 50.0;
    Ok(Rotation {
        name: candidate.name,
        pulse_rate_hz,
        time_s,
        speed_rad_per_s,
        friction_nm,
        follows,
        mean_nm,
        peak_nm,
    })
}

impl Sine {
    pub fn facts(&self) -> Vec<Fact> {
        let peak = self.torque_nm.iter().fold(0.0, |most: f64, torque| most.max(torque.abs()));
        let text = format!(
            "{}: largest friction torque under a sine of 1 Hz and {SINE_RAD_PER_S} rad/s (figures 7, 12)",
            self.name
        );
        let group = "Friction under a sine of speed (figures 7 and 12)";
        vec![Fact {
            group,
            id: format!("sine_peak_{}", self.name),
            text,
            value: peak,
            unit: "N·m",
            stated: None,
        }]
    }

    pub fn to_json(&self) -> Value {
        json!({ "model": self.name, "time_s": self.time_s, "speed_rad_per_s": self.speed_rad_per_s, "torque_nm": self.torque_nm })
    }
}

impl Rotation {
    pub fn facts(&self) -> Vec<Fact> {
        let khz = self.pulse_rate_hz / 1e3;
        let fact = |what: &str, value: f64, unit: &'static str, stated: Option<f64>, text: &str| Fact {
            group: "Rotation by the motor (figures 10 and 11)",
            id: format!("rotation_{khz}khz_{}_{what}", self.name),
            text: format!("{} at {khz} kHz: {text}", self.name),
            value,
            unit,
            stated,
        };
        let follows = f64::from(u8::from(self.follows));
        let mut facts =
            vec![fact("follows", follows, "1", Some(1.0), "1 where the rotor follows the command")];
        if self.follows {
            facts.push(fact("mean", self.mean_nm, "N·m", Some(STATED_MEAN_NM), "mean friction torque"));
            facts.push(fact(
                "peak",
                self.peak_nm,
                "N·m",
                Some(STATED_PEAK_NM),
                "largest friction torque at the start, with a ramp of 10 MHz/s",
            ));
        }
        facts
    }

    pub fn to_json(&self) -> Value {
        json!({
            "model": self.name, "pulse_rate_hz": self.pulse_rate_hz, "follows": self.follows,
            "mean_nm": self.mean_nm, "peak_nm": self.peak_nm, "time_s": self.time_s,
            "speed_rad_per_s": self.speed_rad_per_s, "friction_nm": self.friction_nm,
        })
    }
}

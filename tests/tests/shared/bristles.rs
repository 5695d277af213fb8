//! Torque logs of a friction that is written down here once more: LuGre at 40 kHz, with none of the product's code nor of the rig's.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use log_data::Run;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

const RATE_HZ: usize = 1000;
/// Steps of the integration in a sample.
const STEPS: usize = 40;
const LASTS_S: f64 = 4.0;
/// Between runs, s.
const PAUSE_S: f64 = 25.0;
const NOISE_NM: f64 = 0.01;

/// The numbers of a contact and its load, SI.
#[derive(Clone, Copy)]
pub struct Contact {
    pub coulomb_nm: f64,
    pub static_nm: f64,
    pub stribeck_rad_per_s: f64,
    pub stiffness: f64,
    pub damping: f64,
    pub viscous: f64,
    pub inertia: f64,
}

/// Those of rt-config/models/rig.toml.
pub const RIG: Contact = Contact {
    coulomb_nm: 1.5,
    static_nm: 3.0,
    stribeck_rad_per_s: 0.05,
    stiffness: 1000.0,
    damping: 1.0,
    viscous: 2e-4,
    inertia: 1e-4,
};

/// Speed at a time.
#[derive(Clone, Copy)]
enum Motion {
    /// There and back at this speed, with rests and ramps of a tenth of a second.
    Strokes(f64),
    /// An amplitude and a frequency, begun gently.
    Sine(f64, f64),
}

const MOTIONS: [Motion; 9] = [
    Motion::Strokes(0.05),
    Motion::Strokes(0.3),
    Motion::Strokes(2.0),
    Motion::Strokes(12.0),
    Motion::Strokes(40.0),
    Motion::Sine(0.4, 1.0),
    Motion::Sine(0.1, 4.0),
    Motion::Sine(0.003, 3.0),
    Motion::Sine(0.3, 3.0),
];

fn smooth(part: f64) -> f64 {
    let part = part.clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}

impl Motion {
    fn speed(self, time_s: f64) -> f64 {
        match self {
            Self::Strokes(speed) => {
                let (period, half) = (0.5 * LASTS_S, 0.25 * LASTS_S);
                let phase = time_s % period;
                let (way, since) = if phase < half { (1.0, phase) } else { (-1.0, phase - half) };
                way * speed * smooth((since - 0.1) / 0.1) * smooth((half - 0.1 - since) / 0.1)
            }
            Self::Sine(amplitude, hz) => {
                let angle = |time_s: f64| amplitude * (TAU * hz * time_s).sin() * smooth(time_s / 0.3);
                let step = 1e-6;
                (angle(time_s + step) - angle(time_s - step)) / (2.0 * step)
            }
        }
    }
}

/// All motions twice, measured with this encoder and noise of 0.01 N·m.
pub fn campaign(contact: Contact, counts: f64, seed: u64) -> Vec<Run> {
    of_motions(2 * MOTIONS.len(), contact, counts, seed)
}

/// The first so many of the motions, begun anew where there are no more.
pub fn of_motions(count: usize, contact: Contact, counts: f64, seed: u64) -> Vec<Run> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let runs = MOTIONS.into_iter().cycle().take(count).enumerate();
    runs.map(|(number, motion)| run(contact, counts, (number, motion), &mut random)).collect()
}

fn run(contact: Contact, counts: f64, (number, motion): (usize, Motion), random: &mut Pcg64Mcg) -> Run {
    let noise = Normal::new(0.0, NOISE_NM).unwrap();
    let step_s = 1.0 / (RATE_HZ * STEPS) as f64;
    let count_rad = TAU / counts;
    let begins_s = (LASTS_S + PAUSE_S) * number as f64;
    let (mut angle, mut bristle) = (0.0, 0.0);
    let (mut time_s, mut angle_rad, mut torque_nm) = (Vec::new(), Vec::new(), Vec::new());
    for index in 0..(LASTS_S * RATE_HZ as f64) as usize * STEPS {
        let at = index as f64 * step_s;
        let (now, next) = (motion.speed(at), motion.speed(at + step_s));
        let level = |speed: f64| {
            let bump = (-(speed / contact.stribeck_rad_per_s).powi(2)).exp();
            contact.coulomb_nm + (contact.static_nm - contact.coulomb_nm) * bump
        };
        let rate =
            |speed: f64, bristle: f64| speed - contact.stiffness * speed.abs() / level(speed) * bristle;
        if index.is_multiple_of(STEPS) {
            let acceleration = (next - motion.speed(at - step_s)) / (2.0 * step_s);
            let torque = contact.stiffness * bristle
                + contact.damping * rate(now, bristle)
                + contact.viscous * now
                + contact.inertia * acceleration;
            time_s.push(begins_s + at);
            angle_rad.push((angle / count_rad).round() * count_rad);
            torque_nm.push(torque + noise.sample(random));
        }
        // Exact for a speed that is constant over the step: at 40 rad/s the bristle's own time is 40 µs.
        let mean = 0.5 * (now + next);
        let pull = contact.stiffness * mean.abs() / level(mean);
        let rest = if pull > 1e-9 { mean / pull } else { 0.0 };
        bristle = if pull > 1e-9 {
            rest + (bristle - rest) * (-pull * step_s).exp()
        } else {
            bristle + mean * step_s
        };
        angle += mean * step_s;
    }
    Run {
        name: format!("run-{number:02}"),
        kind: "test".to_owned(),
        pressure_drop_pa: Some(vec![1e6; time_s.len()]),
        time_s,
        angle_rad,
        torque_nm: Some(torque_nm),
        ..Run::default()
    }
}

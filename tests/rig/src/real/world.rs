//! What a measurement of the real family is like: instruments, the model's accuracy, what was recorded, drawn from a seed.
//!
//! The exact family has one such world: a fine encoder, white noise, exact numbers, all channels.

use crate::log_kind::LogKind;
use crate::nominal::{Nominal, log_uniform};
use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// Standard deviation of a nominal number that a model file stands for where it says nothing: 3 %. A number that is off by
/// up to 5 %, evenly, has a standard deviation of 2.9 %: this covers it, so the files need no section on it.
pub(crate) const TOLERANCE: f64 = 0.03;
/// The most that a nominal number is off by.
const MOST_OFF: f64 = 0.05;

/// The encoder.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Encoder {
    /// One count, rad; 0 for sine and cosine tracks, which are interpolated.
    pub step_rad: f64,
    /// Standard deviation before it is counted, rad.
    pub noise_rad: f64,
}

impl Encoder {
    /// Standard deviation of what it reads, rad.
    pub fn deviation_rad(&self) -> f64 {
        (self.noise_rad.powi(2) + self.step_rad.powi(2) / 12.0).sqrt()
    }
}

/// The noise's colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Colour {
    White,
    /// A part of it has a memory of so long, s; the rest is white.
    Slow {
        memory_s: f64,
    },
    /// A part of it is a tone of the mains.
    Mains {
        frequency_hz: f64,
        phase_rad: f64,
    },
}

/// In how many runs a channel was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Presence {
    All,
    Some,
    None,
}

/// Where the motions come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// Experiments made to be analysed.
    TestRig,
    /// A machine at its work: the same few moves over and over.
    Production,
    /// What `stepvalve simulate` does: steps, sines and rotations at a cycle of a millisecond.
    Loop,
}

/// One measurement's circumstances.
#[derive(Debug, Clone)]
pub(crate) struct World {
    pub source: Source,
    pub rate_hz: f64,
    pub runs: usize,
    pub run_s: f64,
    pub encoder: Encoder,
    pub colour: Colour,
    /// Standard deviation of the predicted channel's noise, N·m or rad; an encoder's count comes on top.
    pub noise: f64,
    /// The torque transducer's, Hz; it is damped at 0.7.
    pub bandwidth_hz: f64,
    /// By what part each of the model file's numbers is off, at most.
    pub off_by: f64,
    /// Standard deviation of the predicted channel's zero from run to run, and its drift per second.
    pub zero: f64,
    pub drift_per_s: f64,
    pub pressure: Presence,
    pub temperature: Presence,
    /// The part of the samples that is missing.
    pub missing: f64,
    /// The stroke that motions stay within, rad; none for whole turns.
    pub stroke_rad: Option<f64>,
}

fn one_in(rng: &mut Pcg64, of: u32) -> bool {
    rng.random_range(0..of) == 0
}

fn presence(rng: &mut Pcg64) -> Presence {
    match rng.random_range(0..10) {
        0..7 => Presence::All,
        7 => Presence::Some,
        _ => Presence::None,
    }
}

impl World {
    pub fn draw(kind: LogKind, nominal: &Nominal, samples: usize, rng: &mut Pcg64) -> Self {
        let source = [Source::TestRig, Source::Production, Source::Loop][rng.random_range(0..3)];
        let rate_hz = match source {
            Source::Loop => [250.0, 500.0, 1000.0, 2000.0, 4000.0][rng.random_range(0..5)],
            _ => log_uniform(rng, 100.0, 10_000.0).round(),
        };
        let total_s = (samples as f64 / rate_hz).max(4.0);
        let (fewest, most) = ((total_s / 300.0).max(1.0), total_s.min(60.0));
        let runs = log_uniform(rng, fewest, most * 1.001).round().clamp(1.0, 60.0);
        let colour = match rng.random_range(0..3) {
            0 => Colour::White,
            1 => Colour::Slow { memory_s: log_uniform(rng, 2e-3, 50e-3) },
            _ => Colour::Mains {
                frequency_hz: if one_in(rng, 2) { 50.0 } else { 60.0 },
                phase_rad: rng.random_range(0.0..TAU),
            },
        };
        let (noise, zero, drift) = match kind {
            LogKind::Torque => (
                log_uniform(rng, 0.003, 0.03) * nominal.coulomb_nm,
                log_uniform(rng, 0.005, 0.04) * nominal.coulomb_nm,
                log_uniform(rng, 1e-5, 2e-3).min(0.1 * nominal.coulomb_nm / total_s),
            ),
            LogKind::Angle => (log_uniform(rng, 1e-5, 2e-4), log_uniform(rng, 1e-5, 3e-4), 0.0),
        };
        Self {
            source,
            rate_hz,
            runs: runs as usize,
            run_s: total_s / runs,
            encoder: encoder(kind, rng),
            colour,
            noise,
            bandwidth_hz: log_uniform(rng, 50.0, 2000.0),
            off_by: rng.random_range(0.0..MOST_OFF),
            zero: if one_in(rng, 2) { zero } else { 0.0 },
            drift_per_s: if one_in(rng, 2) { drift * rng.random_range(-1.0..1.0) } else { 0.0 },
            pressure: presence(rng),
            temperature: presence(rng),
            missing: if one_in(rng, 3) { log_uniform(rng, 1e-4, 1e-2) } else { 0.0 },
            stroke_rad: one_in(rng, 2).then(|| rng.random_range(0.5..4.0)),
        }
    }
}

fn encoder(kind: LogKind, rng: &mut Pcg64) -> Encoder {
    if one_in(rng, 4) {
        let noise_rad = log_uniform(rng, 1e-6, 1e-4);
        return Encoder { step_rad: 0.0, noise_rad };
    }
    let counts = log_uniform(rng, 4e3, 4e6).round();
    let step_rad = TAU / counts;
    // Where the angle is what is predicted, its noise is drawn by itself.
    let noise_rad = if kind == LogKind::Torque { step_rad * rng.random_range(0.0..0.4) } else { 0.0 };
    Encoder { step_rad, noise_rad }
}

//! The encoder at the spool: noise, quantisation, and the age of its reading.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// The oldest reading that can be simulated, in cycles.
const MAX_DELAY_CYCLES: usize = config::LARGEST_ENCODER_DELAY_CYCLES as usize;

/// An encoder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EncoderParams {
    /// Counts per turn.
    pub counts_per_turn: f64,
    /// Noise before quantisation, RMS, rad.
    pub noise_rad: f64,
    /// Age of the reading, in cycles; at most 16.
    pub delay_cycles: usize,
    /// Seed of the noise.
    pub seed: u64,
}

/// An encoder's state: its noise, and the readings under way.
#[derive(Debug, Clone)]
pub(crate) struct Encoder {
    params: EncoderParams,
    noise: Pcg64Mcg,
    readings: [i64; MAX_DELAY_CYCLES + 1],
}

impl Encoder {
    pub(crate) fn new(params: EncoderParams, angle_rad: f64) -> Self {
        let mut encoder =
            Self { params, noise: Pcg64Mcg::seed_from_u64(params.seed), readings: [0; MAX_DELAY_CYCLES + 1] };
        encoder.readings = [encoder.counts(angle_rad); MAX_DELAY_CYCLES + 1];
        encoder
    }

    /// Takes the reading of a new cycle.
    pub(crate) fn sample(&mut self, angle_rad: f64) {
        let noise: f64 = StandardNormal.sample(&mut self.noise);
        self.readings.rotate_right(1);
        let counts = self.counts(angle_rad + noise * self.params.noise_rad);
        if let Some(newest) = self.readings.first_mut() {
            *newest = counts;
        }
    }

    /// What the drive reports now: counts, and the angle they stand for, rad.
    pub(crate) fn reading(&self) -> (i64, f64) {
        let counts = self.readings.get(self.params.delay_cycles).copied().unwrap_or_default();
        (counts, counts as f64 * TAU / self.params.counts_per_turn)
    }

    fn counts(&self, angle_rad: f64) -> i64 {
        // `as` saturates, and takes NaN to zero.
        (angle_rad / TAU * self.params.counts_per_turn).round() as i64
    }
}

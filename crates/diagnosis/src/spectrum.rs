//! At which frequencies a residual is larger than the measurement's noise: its mean periodogram in bands of half an octave,
//! and whether it is one tone.
#![allow(clippy::indexing_slicing, reason = "a spectrum is indexed by its own size")]

use crate::linear::Setting;
use crate::measure::Left;
use crate::show::holm;
use realfft::RealFftPlanner;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// Samples of a segment, where the log has pieces as long; and the fewest that tell anything.
const SEGMENT: usize = 1024;
const LEAST_SEGMENT: usize = 64;
/// Equivalent noise bandwidth of Hann's window, in bins.
const HANN: f64 = 1.5;

/// A band of frequencies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Band {
    /// From this frequency, Hz.
    pub from_hz: f64,
    /// To this one.
    pub to_hz: f64,
    /// RMS of the error in the band.
    pub rms: f64,
    /// What the measurement's noise has there.
    pub noise: f64,
    /// Probability that noise alone is as large, corrected for the number of bands.
    pub p_value: f64,
}

/// A tone's main lobe reaches so many bins to either side of its peak, as the window has it, ...
const LOBE: usize = 2;
/// ... which hold at least this part of the power; and in as many bins beyond it on either side no more than this part of that.
const MOSTLY: f64 = 0.3;
const BESIDE: f64 = 0.05;

/// What is left, as a mean periodogram.
pub(crate) struct Spectrum {
    /// Of each bin, such that the sum over bins is the mean square in parts of the noise's.
    power: Vec<f64>,
    segments: usize,
    bin_hz: f64,
}

/// A residual that is mostly one tone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tone {
    pub hz: f64,
    /// In parts of the noise.
    pub amplitude: f64,
    /// Of the mean square.
    pub share: f64,
}

/// The spectrum of what is left; without bins where all pieces are short.
pub(crate) fn spectrum(setting: &Setting<'_>, left: &[Left]) -> Spectrum {
    let longest = setting.campaign.pieces.iter().map(|piece| piece.len()).max().unwrap_or(0);
    let length = if longest >= SEGMENT { SEGMENT } else { (longest + 1).next_power_of_two() / 2 };
    if length < LEAST_SEGMENT {
        return Spectrum { power: Vec::new(), segments: 0, bin_hz: 0.0 };
    }
    let weighted = setting.campaign.pieces.iter().zip(left).map(|(piece, left)| {
        left.residual.iter().zip(&piece.weights).map(|(value, weight)| value * weight).collect()
    });
    let (power, segments) = periodogram(weighted, length);
    Spectrum { power, segments, bin_hz: 1.0 / (length as f64 * setting.campaign.facts.step_s) }
}

/// The mean power of each frequency bin over the segments, such that the sum over bins is the mean square.
fn periodogram(pieces: impl Iterator<Item = Vec<f64>>, length: usize) -> (Vec<f64>, usize) {
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let window: Vec<f64> =
        (0..length).map(|k| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / length as f64).cos()).collect();
    let scale = 2.0 / (length as f64 * window.iter().map(|w| w * w).sum::<f64>());
    let mut spectrum = transform.make_output_vec();
    let mut power = vec![0.0; spectrum.len()];
    let mut segments = 0;
    for values in pieces {
        for segment in values.chunks_exact(length) {
            let mut windowed: Vec<f64> = segment.iter().zip(&window).map(|(a, w)| a * w).collect();
            if transform.process(&mut windowed, &mut spectrum).is_ok() {
                power.iter_mut().zip(&spectrum).for_each(|(sum, bin)| *sum += scale * bin.norm_sqr());
                segments += 1;
            }
        }
    }
    power.iter_mut().for_each(|sum| *sum /= f64::from(segments.max(1)));
    (power, segments as usize)
}

impl Spectrum {
    /// In bands; `noise` is the residual's unit.
    pub fn bands(&self, noise: f64) -> Vec<Band> {
        in_bands(&self.power, self.segments, self.bin_hz, noise)
    }

    /// The tone that most of it is.
    pub fn tone(&self) -> Option<Tone> {
        let all: f64 = self.power.iter().sum();
        let whole = LOBE + 1..self.power.len().saturating_sub(LOBE);
        let peak = whole.max_by(|a, b| self.power[*a].total_cmp(&self.power[*b]))?;
        let lobe = peak - LOBE..=peak + LOBE;
        let inside: f64 = self.power[lobe.clone()].iter().sum();
        let around = peak.saturating_sub(2 * LOBE)..self.power.len().min(peak + 2 * LOBE + 1);
        let beside = self.power[around].iter().sum::<f64>() - inside;
        let clear = inside > MOSTLY * all && beside < BESIDE * inside;
        let bin = lobe.map(|bin| bin as f64 * self.power[bin]).sum::<f64>() / inside;
        clear.then(|| Tone { hz: bin * self.bin_hz, amplitude: f64::sqrt(2.0 * inside), share: inside / all })
    }
}

fn in_bands(power: &[f64], segments: usize, bin_hz: f64, noise: f64) -> Vec<Band> {
    let count = power.len().saturating_sub(1).max(1) as f64;
    let mut found = Vec::new();
    let mut from = 1;
    while from < power.len() && segments > 0 {
        let to = ((from as f64 * std::f64::consts::SQRT_2).ceil() as usize).clamp(from + 1, power.len());
        let bins = (to - from) as f64;
        let square: f64 = power.iter().take(to).skip(from).sum();
        // What white noise of variance 1 has in a bin.
        let expected = bins / count;
        let freedom = (2.0 * bins * segments as f64 / HANN).max(1.0);
        let p_value = ChiSquared::new(freedom).map_or(1.0, |chi| 1.0 - chi.cdf(freedom * square / expected));
        found.push(Band {
            from_hz: from as f64 * bin_hz,
            to_hz: to as f64 * bin_hz,
            rms: noise * square.sqrt(),
            noise: noise * expected.sqrt(),
            p_value,
        });
        from = to;
    }
    holm(found.iter_mut().map(|band| &mut band.p_value));
    found
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn a_tone_stands_out_in_its_band_alone() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(1);
        let noise: Vec<f64> = (0..16_384).map(|_| StandardNormal.sample(&mut random)).collect();
        let with = |amplitude: f64| -> Vec<Band> {
            let tone = |k: usize| amplitude * (TAU * 0.05 * k as f64).sin();
            let values = noise.iter().enumerate().map(|(k, value)| value + tone(k)).collect();
            let (power, segments) = periodogram(std::iter::once(values), 1024);
            in_bands(&power, segments, 1000.0 / 1024.0, 2.0)
        };
        let rms = |bands: &[Band]| bands.iter().map(|band| band.rms * band.rms).sum::<f64>().sqrt();
        let (without, with) = (with(0.0), with(0.5));
        assert!((rms(&without) - 2.0).abs() < 0.05, "{}", rms(&without));
        assert!(without.iter().all(|band| band.p_value > 0.01), "{without:?}");
        // 50 Hz at 1 kHz.
        let (inside, outside): (Vec<&Band>, Vec<&Band>) =
            with.iter().partition(|band| (band.from_hz..band.to_hz).contains(&50.0));
        assert!(inside.iter().all(|band| band.p_value < 1e-6), "{inside:?}");
        assert!(outside.iter().filter(|band| band.p_value < 0.01).count() <= 1, "{outside:?}");
    }

    #[test]
    fn a_tone_is_told_from_noise_that_is_merely_slow() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(2);
        let white: Vec<f64> = (0..16_384).map(|_| StandardNormal.sample(&mut random)).collect();
        let found = |values: Vec<f64>| {
            let (power, segments) = periodogram(std::iter::once(values), 1024);
            Spectrum { power, segments, bin_hz: 1000.0 / 1024.0 }.tone()
        };
        let tone = |k: usize| 3.0 * (TAU * 0.0437 * k as f64).sin();
        let tone = found(white.iter().enumerate().map(|(k, value)| value + tone(k)).collect()).unwrap();
        assert!((tone.hz - 43.7).abs() < 0.2 && (tone.amplitude - 3.0).abs() < 0.1, "{tone:?}");
        assert!((tone.share - 4.5 / 5.5).abs() < 0.05, "{tone:?}");
        let mut low = 0.0;
        let slow = white.iter().map(|value| {
            low += 0.05 * (value - low);
            low
        });
        assert_eq!(found(slow.collect()), None);
        assert_eq!(found(white.clone()), None);
    }
}

//! Detects a residual that is mostly one tone: present in most segments, and not at a frequency at which the valve
//! moves.
#![allow(clippy::indexing_slicing, reason = "a spectrum is indexed by its own size")]

use crate::fit::equations::Setting;
use crate::log::piece::Piece;
use crate::show::residual::PieceResidual;
use crate::show::spectrum::{Spectrum, spectrum, spectrum_of};
use std::ops::RangeInclusive;

/// Half width of the window's main lobe, bins.
const LOBE: usize = 2;
/// Least share of the power within the main lobe, and largest power beside it relative to that within.
const MOSTLY: f64 = 0.3;
const BESIDE: f64 = 0.05;
/// Least share of the segments with the tone, and largest share of the speed's power in the same bins.
const ALIKE: f64 = 0.75;
const OF_MOTION: f64 = 0.05;

/// A residual that is mostly one tone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tone {
    pub hz: f64,
    /// Relative to the noise.
    pub amplitude: f64,
    /// Its share of the mean square.
    pub share: f64,
}

/// The tone that dominates the residual; `None` at a frequency of the motion itself.
pub(crate) fn tone(setting: &Setting<'_>, left: &[PieceResidual]) -> Option<Tone> {
    let (tone, lobe) = strongest(&spectrum(setting, left))?;
    let speeds = |_: usize, piece: &Piece| -> Vec<f64> {
        let speed = (0..piece.len()).map(|index| piece.kinematics(index).1);
        speed.map(|speed| if speed.is_finite() { speed } else { 0.0 }).collect()
    };
    let motion = spectrum_of(setting, speeds).mean();
    (share(&motion, &lobe) < OF_MOTION).then_some(tone)
}

/// The strongest tone of a spectrum if it dominates it, and its bins.
fn strongest(spectrum: &Spectrum) -> Option<(Tone, RangeInclusive<usize>)> {
    let mean = spectrum.mean();
    let peak = (1..mean.len()).max_by(|a, b| mean[*a].total_cmp(&mean[*b]))?;
    if peak <= LOBE || peak + LOBE >= mean.len() {
        return None;
    }
    let lobe = peak - LOBE..=peak + LOBE;
    let inside: f64 = mean[lobe.clone()].iter().sum();
    let around = peak.saturating_sub(2 * LOBE)..mean.len().min(peak + 2 * LOBE + 1);
    let beside = mean[around].iter().sum::<f64>() - inside;
    let alike = spectrum.segments.iter().filter(|power| share(power, &lobe) > MOSTLY).count();
    let common = alike as f64 >= ALIKE * spectrum.segments.len() as f64;
    let share = share(&mean, &lobe);
    let clear = share > MOSTLY && beside < BESIDE * inside && common;
    let bin = lobe.clone().map(|bin| bin as f64 * mean[bin]).sum::<f64>() / inside;
    let tone = Tone { hz: bin * spectrum.bin_hz, amplitude: f64::sqrt(2.0 * inside), share };
    clear.then_some((tone, lobe))
}

/// The share of the power in these bins.
fn share(power: &[f64], bins: &RangeInclusive<usize>) -> f64 {
    let all: f64 = power.iter().skip(1).sum();
    let inside: f64 = power.get(bins.clone()).map_or(0.0, |inside| inside.iter().sum());
    if all > 0.0 { inside / all } else { 0.0 }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::show::spectrum::periodograms;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use std::f64::consts::TAU;

    #[test]
    fn a_tone_is_told_from_slow_noise_and_from_one_loud_run() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(2);
        let white: Vec<f64> = (0..16_384).map(|_| StandardNormal.sample(&mut random)).collect();
        let found = |values: Vec<f64>| {
            let segments = periodograms(std::iter::once(values), 1024);
            strongest(&Spectrum { segments, bin_hz: 1000.0 / 1024.0 }).map(|(tone, _)| tone)
        };
        let hum = |k: usize| (TAU * 0.0437 * k as f64).sin();
        let tone = found(white.iter().enumerate().map(|(k, value)| value + 3.0 * hum(k)).collect()).unwrap();
        assert!((tone.hz - 43.7).abs() < 0.2 && (tone.amplitude - 3.0).abs() < 0.1, "{tone:?}");
        assert!((tone.share - 4.5 / 5.5).abs() < 0.05, "{tone:?}");
        let one_loud =
            white.iter().enumerate().map(|(k, value)| value + if k < 2048 { 9.0 * hum(k) } else { 0.0 });
        assert_eq!(found(one_loud.collect()), None);
        let mut low = 0.0;
        let slow = white.iter().map(|value| {
            low += 0.05 * (value - low);
            low
        });
        assert_eq!(found(slow.collect()), None);
        assert_eq!(found(white.clone()), None);
    }
}

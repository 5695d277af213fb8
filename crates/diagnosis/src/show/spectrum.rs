//! At which frequencies a residual is larger than the measurement's noise: its mean periodogram in bands of half an octave.

use crate::fit::equations::Setting;
use crate::log::piece::Piece;
use crate::numerics::statistics::holm;
use crate::outcome::Band;
use crate::show::residual::PieceResidual;
use realfft::RealFftPlanner;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// Samples of a segment if the log has pieces that long, and the least number that is of use.
const SEGMENT: usize = 1024;
const LEAST_SEGMENT: usize = 64;
/// Equivalent noise bandwidth of Hann's window, in bins.
const HANN: f64 = 1.5;

/// Periodograms of segments of a residual, or of another signal.
pub(crate) struct Spectrum {
    /// The power of each segment by frequency bin, such that the sum over bins is the mean square (of a residual, relative to
    /// the noise variance).
    pub segments: Vec<Vec<f64>>,
    pub bin_hz: f64,
}

/// The spectrum of the normalised residual; without bins if all pieces are short.
pub(crate) fn spectrum(setting: &Setting<'_>, left: &[PieceResidual]) -> Spectrum {
    spectrum_of(setting, |index, piece| {
        let residual = left.get(index).map_or(&[][..], |left| &left.residual);
        piece.in_deviations(residual)
    })
}

/// The spectrum of a signal, of which `values` gives the samples in each piece.
pub(crate) fn spectrum_of(setting: &Setting<'_>, values: impl Fn(usize, &Piece) -> Vec<f64>) -> Spectrum {
    let pieces = &setting.campaign.pieces;
    let longest = pieces.iter().map(Piece::len).max().unwrap_or(0);
    let length = if longest >= SEGMENT { SEGMENT } else { (longest + 1).next_power_of_two() / 2 };
    if length < LEAST_SEGMENT {
        return Spectrum { segments: Vec::new(), bin_hz: 0.0 };
    }
    let all = pieces.iter().enumerate().map(|(index, piece)| values(index, piece));
    let bin_hz = 1.0 / (length as f64 * setting.campaign.facts.step_s);
    Spectrum { segments: periodograms(all, length), bin_hz }
}

/// The power of each segment by frequency bin, such that the sum over bins is the mean square.
pub(crate) fn periodograms(pieces: impl Iterator<Item = Vec<f64>>, length: usize) -> Vec<Vec<f64>> {
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let window: Vec<f64> =
        (0..length).map(|k| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / length as f64).cos()).collect();
    let scale = 2.0 / (length as f64 * window.iter().map(|w| w * w).sum::<f64>());
    let mut spectrum = transform.make_output_vec();
    let mut found = Vec::new();
    for values in pieces {
        for segment in values.chunks_exact(length) {
            let mut windowed: Vec<f64> = segment.iter().zip(&window).map(|(a, w)| a * w).collect();
            if transform.process(&mut windowed, &mut spectrum).is_ok() {
                found.push(spectrum.iter().map(|bin| scale * bin.norm_sqr()).collect());
            }
        }
    }
    found
}

impl Spectrum {
    /// RMS and noise by frequency band. `noise` is what the residual was divided by.
    pub fn bands(&self, noise: f64) -> Vec<Band> {
        in_bands(&self.mean(), self.segments.len(), self.bin_hz, noise)
    }

    /// The mean over the segments.
    pub fn mean(&self) -> Vec<f64> {
        let mut mean = vec![0.0; self.segments.first().map_or(0, Vec::len)];
        for power in &self.segments {
            mean.iter_mut().zip(power).for_each(|(sum, bin)| *sum += bin / self.segments.len() as f64);
        }
        mean
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
        // The power in the band of white noise of variance 1.
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
            let segments = periodograms(std::iter::once(values), 1024);
            Spectrum { segments, bin_hz: 1000.0 / 1024.0 }.bands(2.0)
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
}

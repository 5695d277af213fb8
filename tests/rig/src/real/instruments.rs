//! Instruments: what they make of a torque or an angle.

use super::world::{Colour, Encoder, World};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

/// Damping of a transducer's low-pass.
const DAMPING: f64 = 0.7;
/// Steps of the low-pass for each of its own radians.
const STEPS_PER_RADIAN: f64 = 20.0;
/// The variance of coloured noise that is no white noise.
const COLOURED: f64 = 0.7;
/// Samples that go missing together, at most.
const LONGEST_GAP: usize = 20;

pub(super) fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

/// How late a transducer of limited bandwidth is where the torque is slow, s: 2·damping/ω₀ of its low-pass.
pub(super) fn lag_s(bandwidth_hz: f64) -> f64 {
    2.0 * DAMPING / (TAU * bandwidth_hz)
}

/// A torque as a transducer of limited bandwidth passes it on, linear between the samples; it begins settled.
pub(super) fn transduced(times_s: &[f64], torque_nm: &[f64], bandwidth_hz: f64) -> Vec<f64> {
    let w = TAU * bandwidth_hz;
    let (mut value, mut rate) = (torque_nm[0], 0.0);
    let mut passed = vec![value];
    for k in 1..torque_nm.len() {
        let length_s = times_s[k] - times_s[k - 1];
        let steps = (w * length_s * STEPS_PER_RADIAN).ceil().clamp(1.0, 2000.0) as usize;
        let h = length_s / steps as f64;
        for step in 1..=steps {
            let part = step as f64 / steps as f64;
            let input = torque_nm[k - 1] + part * (torque_nm[k] - torque_nm[k - 1]);
            // The speed implicitly, so that no step is too long.
            rate = (rate + h * w * w * (input - value)) / (1.0 + 2.0 * DAMPING * w * h + w * w * h * h);
            value += h * rate;
        }
        passed.push(value);
    }
    passed
}

/// Noise of a world's colour and size.
pub(super) fn noise(world: &World, times_s: &[f64], rng: &mut Pcg64) -> Vec<f64> {
    let (coloured, white) = (world.noise * COLOURED.sqrt(), world.noise * (1.0 - COLOURED).sqrt());
    let mut state = normal(rng);
    let mut before_s = times_s[0];
    let one = |&time_s: &f64| match world.colour {
        Colour::White => world.noise * normal(rng),
        Colour::Slow { memory_s } => {
            let kept = (-(time_s - before_s) / memory_s).exp();
            state = kept * state + (1.0 - kept * kept).sqrt() * normal(rng);
            before_s = time_s;
            coloured * state + white * normal(rng)
        }
        Colour::Mains { frequency_hz, phase_rad } => {
            let tone = (TAU * frequency_hz * time_s + phase_rad).sin() * 2f64.sqrt();
            coloured * tone + white * normal(rng)
        }
    };
    times_s.iter().map(one).collect()
}

/// An angle as an encoder reads it.
pub(super) fn read(encoder: &Encoder, angle_rad: f64, rng: &mut Pcg64) -> f64 {
    let noisy = angle_rad + encoder.noise_rad * normal(rng);
    if encoder.step_rad > 0.0 { (noisy / encoder.step_rad).round() * encoder.step_rad } else { noisy }
}

/// Takes samples out, a few neighbours at a time.
pub(super) fn lose(values: &mut [f64], part: f64, rng: &mut Pcg64) {
    let mut left = (part * values.len() as f64) as usize;
    while left > 0 {
        let length = rng.random_range(1..=LONGEST_GAP).min(left);
        let from = rng.random_range(1..values.len().max(2));
        values.iter_mut().skip(from).take(length).for_each(|value| *value = f64::NAN);
        left -= length;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn a_transducer_passes_slow_tones_and_holds_back_fast_ones() {
        let times_s: Vec<f64> = (0..20_000).map(|k| 1e-4 * f64::from(k)).collect();
        let size = |frequency_hz: f64| {
            let tone: Vec<f64> = times_s.iter().map(|time| (TAU * frequency_hz * time).sin()).collect();
            let passed = transduced(&times_s, &tone, 100.0);
            2f64.sqrt() * (passed[10_000..].iter().map(|value| value * value).sum::<f64>() / 10_000.0).sqrt()
        };
        assert!((size(10.0) - 1.0).abs() < 0.01, "{}", size(10.0));
        // |H| of a second-order low-pass damped at 0.7: 0.714 at its frequency, 1/16.0 at four times it.
        assert!((size(100.0) - 0.714).abs() < 0.03, "{}", size(100.0));
        assert!((size(400.0) - 0.0624).abs() < 0.01, "{}", size(400.0));
    }

    #[test]
    fn a_ramp_comes_as_late_as_the_answer_key_says() {
        for bandwidth_hz in [50.0, 437.0, 2000.0] {
            let ramp: Vec<f64> = (0..500).map(|k| 2e-3 * f64::from(k)).collect();
            let passed = transduced(&ramp, &ramp, bandwidth_hz);
            let (late_s, key_s) = (ramp[499] - passed[499], lag_s(bandwidth_hz));
            assert!((late_s / key_s - 1.0).abs() < 0.03, "{bandwidth_hz} Hz: {late_s} s, key {key_s} s");
        }
    }

    #[test]
    fn an_encoder_reads_whole_counts() {
        let mut rng = Pcg64::seed_from_u64(1);
        let encoder = Encoder { step_rad: 0.01, noise_rad: 0.0 };
        assert_eq!(read(&encoder, 0.0149, &mut rng), 0.01);
        assert!((encoder.deviation_rad() - 0.01 / 12f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn as_many_samples_go_missing_as_are_asked_for_and_never_the_first() {
        let mut rng = Pcg64::seed_from_u64(2);
        let mut values = vec![1.0; 20_000];
        lose(&mut values, 0.01, &mut rng);
        let missing = values.iter().filter(|value| value.is_nan()).count();
        assert!((150..=200).contains(&missing), "{missing}: overlaps and the end take some");
        assert!(values[0].is_finite());
    }
}

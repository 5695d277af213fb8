//! A signal that comes late (effect `sensor-delay`): through a low-pass, and by a time that is the same for all frequencies.

use std::f64::consts::FRAC_1_SQRT_2;
use valve_model::SensorDelay;

/// Damping of the low-pass, that of Butterworth's.
const DAMPING: f64 = FRAC_1_SQRT_2;

/// Makes a signal late in place: by its low-pass, and by what that leaves of the delay.
pub fn delay(time_s: &[f64], values: &mut [f64], late: SensorDelay) {
    let by_low_pass_s = late.delay_s.max(0.0) * late.low_pass_share;
    low_pass(time_s, values, by_low_pass_s);
    shift(time_s, values, late.delay_s - by_low_pass_s);
}

/// A low-pass of order 2 that is late by `delay_s` where it passes all, which is 2·damping/ω₀. It begins settled; between two
/// samples its input is a line, for which the step is exact.
fn low_pass(time_s: &[f64], values: &mut [f64], delay_s: f64) {
    if delay_s <= 0.0 {
        return;
    }
    let rate = 2.0 * DAMPING / delay_s;
    let (decay, swing) = (DAMPING * rate, rate * (1.0 - DAMPING * DAMPING).sqrt());
    let mut state: Option<(f64, f64)> = None;
    let mut before: Option<(f64, f64)> = None;
    for (value, now_s) in values.iter_mut().zip(time_s) {
        let input = *value;
        let (Some((passed, speed)), Some((input_before, before_s))) = (state, before) else {
            (state, before) = (Some((input, 0.0)), Some((input, *now_s)));
            continue;
        };
        let step_s = now_s - before_s;
        before = Some((input, *now_s));
        let slope = (input - input_before) / step_s;
        if !slope.is_finite() {
            // A missing sample: it begins anew.
            (state, before) = if input.is_finite() { (Some((input, 0.0)), before) } else { (None, None) };
            continue;
        }
        // How far it is from following the line late.
        let along = passed - (input_before - slope * delay_s);
        let across = (speed - slope + decay * along) / swing;
        let (sin, cos) = (swing * step_s).sin_cos();
        let left = (-decay * step_s).exp();
        let off = left * (along * cos + across * sin);
        let drift = left * swing * (across * cos - along * sin) - decay * off;
        *value = input - slope * delay_s + off;
        state = Some((*value, slope + drift));
    }
}

/// Replaces each value by that of `delay_s` earlier (later where negative): on the cubic through the two samples before and
/// the two after, on the line between two near the run's ends; where the run has none, the nearest stands for it.
///
/// A line would take amplitude and phase off what is fast: a delay of 388 µs, fitted to swings at 500 Hz, came out 7 µs too short,
/// and 1 µs with cubics. Beside a jump, as where friction changes its sign, a cubic overshoots by 6 % of it for a sample.
fn shift(time_s: &[f64], values: &mut [f64], delay_s: f64) {
    if delay_s == 0.0 {
        return;
    }
    let in_time = values.to_vec();
    let mut after = 0;
    for (value, now_s) in values.iter_mut().zip(time_s) {
        let wanted_s = now_s - delay_s;
        while time_s.get(after).is_some_and(|time_s| *time_s <= wanted_s) {
            after += 1;
        }
        *value = on_cubic(time_s, &in_time, after, wanted_s)
            .unwrap_or_else(|| on_line(time_s, &in_time, after, wanted_s));
    }
}

/// Lagrange's cubic through two samples before `after` and two from it on; `None` where one of them is missing.
fn on_cubic(time_s: &[f64], values: &[f64], after: usize, wanted_s: f64) -> Option<f64> {
    let first = after.checked_sub(2)?;
    let near = first..first + 4;
    let (times, values) = (time_s.get(near.clone())?, values.get(near)?);
    let mut sum = 0.0;
    for (place, (at_s, value)) in times.iter().zip(values).enumerate() {
        let others = times.iter().enumerate().filter(|(other, _)| *other != place);
        let weight: f64 = others.map(|(_, other_s)| (wanted_s - other_s) / (at_s - other_s)).product();
        sum += weight * value;
    }
    sum.is_finite().then_some(sum)
}

/// The value at `wanted_s`, which lies before sample `after` and not before the one ahead of it.
fn on_line(time_s: &[f64], values: &[f64], after: usize, wanted_s: f64) -> f64 {
    let sample = |index: usize| time_s.get(index).copied().zip(values.get(index).copied());
    match (after.checked_sub(1).and_then(sample), sample(after)) {
        (Some((begin_s, begin)), Some((end_s, end))) => {
            begin + (end - begin) * (wanted_s - begin_s) / (end_s - begin_s)
        }
        (Some((_, one)), None) | (None, Some((_, one))) => one,
        (None, None) => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_comes_late_or_early() {
        let time_s: Vec<f64> = (0..20).map(|k| 0.1 * f64::from(k)).collect();
        for delay_s in [0.25, -0.25, 0.1, -0.1, 5.0, -5.0, 0.0] {
            let mut values = time_s.clone();
            shift(&time_s, &mut values, delay_s);
            for (time, value) in time_s.iter().zip(values) {
                let expected = (time - delay_s).clamp(0.0, 1.9);
                assert!(
                    (value - expected).abs() < 1e-12,
                    "{delay_s}: {value} at {time}, expected {expected}"
                );
            }
        }
    }

    #[test]
    fn a_fast_sine_keeps_its_phase_and_amplitude() {
        let time_s: Vec<f64> = (0..500).map(|k| 2e-3 * f64::from(k)).collect();
        let wave = |at_s: f64| (std::f64::consts::TAU * 25.0 * at_s).sin();
        for delay_s in [4e-4, 1e-3, 3.3e-3, -7e-4] {
            let mut values: Vec<f64> = time_s.iter().copied().map(wave).collect();
            shift(&time_s, &mut values, delay_s);
            for (now_s, value) in time_s.iter().zip(&values).skip(5).take(490) {
                let expected = wave(now_s - delay_s);
                assert!(
                    (value - expected).abs() < 3e-4,
                    "{delay_s}: {value} at {now_s}, expected {expected}"
                );
            }
        }
    }

    #[test]
    fn beside_a_jump_it_overshoots_by_little() {
        let time_s: Vec<f64> = (0..20).map(f64::from).collect();
        let mut values: Vec<f64> = (0..20).map(|k| if k < 10 { -1.5 } else { 1.5 }).collect();
        shift(&time_s, &mut values, 0.5);
        assert!(values.iter().all(|value| value.abs() < 1.5 + 0.07 * 3.0), "{values:?}");
    }

    #[test]
    fn a_missing_value_spoils_its_neighbours_alone() {
        let time_s: Vec<f64> = (0..20).map(f64::from).collect();
        let mut values = vec![1.0; 20];
        values[10] = f64::NAN;
        shift(&time_s, &mut values, 0.5);
        let spoilt: Vec<usize> = (0..20).filter(|index| values[*index].is_nan()).collect();
        assert_eq!(spoilt, [10, 11]);
    }

    #[test]
    fn a_low_pass_follows_a_ramp_late_and_lets_slow_swings_pass() {
        let time_s: Vec<f64> = (0..2000).map(|k| 1e-3 * f64::from(k)).collect();
        let mut ramp = time_s.clone();
        low_pass(&time_s, &mut ramp, 5e-3);
        for (time, value) in time_s.iter().zip(&ramp).skip(100) {
            assert!((value - (time - 5e-3)).abs() < 1e-9, "{value} at {time}");
        }
        // The transfer function at ω: 1/(1 − (ω/ω₀)² + 2iζω/ω₀).
        let rate = std::f64::consts::TAU * 40.0;
        let mut wave: Vec<f64> = time_s.iter().map(|time| (rate * time).sin()).collect();
        low_pass(&time_s, &mut wave, 5e-3);
        let ratio = rate * 5e-3 / (2.0 * DAMPING);
        let (real, imaginary) = (1.0 - ratio * ratio, 2.0 * DAMPING * ratio);
        let (amplitude, phase) = (1.0 / real.hypot(imaginary), imaginary.atan2(real));
        for (time, value) in time_s.iter().zip(&wave).skip(200) {
            let expected = amplitude * (rate * time - phase).sin();
            assert!((value - expected).abs() < 5e-3, "{value} at {time}, expected {expected}");
        }
    }

    #[test]
    fn a_delay_may_be_a_low_pass_in_part() {
        let time_s: Vec<f64> = (0..500).map(|k| 1e-3 * f64::from(k)).collect();
        for low_pass_share in [0.0, 0.4, 1.0] {
            let mut ramp = time_s.clone();
            delay(&time_s, &mut ramp, SensorDelay { delay_s: 4e-3, low_pass_share });
            assert!((ramp[400] - (time_s[400] - 4e-3)).abs() < 1e-9, "{low_pass_share}: {}", ramp[400]);
        }
    }
}

//! A signal that comes late (effect `sensor-delay`).

/// Replaces each value by that of `delay_s` earlier (later where negative), linear between samples; where the run has
/// none, the nearest stands for it.
pub fn delay(time_s: &[f64], values: &mut [f64], delay_s: f64) {
    if delay_s == 0.0 {
        return;
    }
    // In the order in which no value is overwritten before it is used.
    let mut near = if delay_s > 0.0 { values.len() } else { 0 };
    let count = values.len();
    for turn in 0..count {
        let index = if delay_s > 0.0 { count - 1 - turn } else { turn };
        let wanted_s = time_s.get(index).copied().unwrap_or(f64::NAN) - delay_s;
        let at = |index: usize| time_s.get(index).copied().unwrap_or(f64::NAN);
        if delay_s > 0.0 {
            while near > 0 && at(near - 1) > wanted_s {
                near -= 1;
            }
        } else {
            while near < count && at(near) <= wanted_s {
                near += 1;
            }
        }
        let delayed = between(time_s, values, near, wanted_s);
        if let Some(value) = values.get_mut(index) {
            *value = delayed;
        }
    }
}

/// The value at `wanted_s`, which lies before sample `after` and not before the one ahead of it.
fn between(time_s: &[f64], values: &[f64], after: usize, wanted_s: f64) -> f64 {
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
            delay(&time_s, &mut values, delay_s);
            for (time, value) in time_s.iter().zip(values) {
                let expected = (time - delay_s).clamp(0.0, 1.9);
                assert!(
                    (value - expected).abs() < 1e-12,
                    "{delay_s}: {value} at {time}, expected {expected}"
                );
            }
        }
    }
}

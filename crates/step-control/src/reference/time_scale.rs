//! How fast the trajectory's time shall run: slower while the motor is short of torque.

/// Parts of the available torque above which time slows down, and below which it recovers.
const STRAINED: f64 = 0.92;
const RELAXED: f64 = 0.85;

/// Rates of slowing down and recovering, 1/s. The first is the trajectory's own.
const SLOWING_PER_S: f64 = 20.0;
const RECOVERING_PER_S: f64 = 2.0;

/// The slowest. Not zero, so that a motion away from an obstacle remains possible.
const SLOWEST: f64 = 0.02;

/// The time scale a cycle later, at a `strain` of the motor (1: all that it can give).
pub(crate) fn next_time_scale(time_scale: f64, strain: f64, period_s: f64) -> f64 {
    let change = if strain > STRAINED {
        -SLOWING_PER_S * period_s
    } else if strain < RELAXED {
        RECOVERING_PER_S * period_s
    } else {
        0.0
    };
    (time_scale + change).clamp(SLOWEST, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slows_when_strained_and_recovers_to_exactly_one() {
        let mut time_scale = 1.0;
        for _ in 0..100 {
            time_scale = next_time_scale(time_scale, 1.2, 1e-3);
        }
        assert_eq!(time_scale, SLOWEST);
        for _ in 0..1000 {
            time_scale = next_time_scale(time_scale, 0.5, 1e-3);
        }
        assert_eq!(time_scale, 1.0);
    }
}

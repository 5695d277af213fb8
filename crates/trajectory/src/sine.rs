//! A sine that begins and goes on smoothly: θ(t) = c + A·s(x)·sin(2πx) with x = f·t.
//!
//! c centre (rad), A amplitude (rad), f frequency (Hz). Over the first period the ramp
//! s(x) = 35x⁴ − 84x⁵ + 70x⁶ − 20x⁷ takes the amplitude from nothing to A; its first three derivatives are zero at
//! both ends, so that speed, acceleration and jerk begin at zero and pass into the sine's without a step.

use std::f64::consts::TAU;

use signals::SetPointRefusal;

use crate::{Limits, Params};
use signals::Kinematics;

/// The greatest |d/dx (s·sin 2πx)|: that of the sine itself, 2π.
const PEAK_SPEED: f64 = TAU;
/// The greatest |d²/dx²|, within the ramp; 1.15 times the sine's own. Rounded up.
const PEAK_ACCELERATION: f64 = 45.465_260;
/// The greatest |d³/dx³|, within the ramp; 1.55 times the sine's own. Rounded up.
const PEAK_JERK: f64 = 384.737_302;

/// A sine about an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sine {
    pub centre_rad: f64,
    pub amplitude_rad: f64,
    pub frequency_hz: f64,
}

/// The ramp and its first three derivatives at x, 0 ≤ x ≤ 1.
fn ramp(x: f64) -> [f64; 4] {
    let square = x * x;
    [
        square * square * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x))),
        square * x * (140.0 + x * (-420.0 + x * (420.0 - 140.0 * x))),
        square * (420.0 + x * (-1680.0 + x * (2100.0 - 840.0 * x))),
        x * (840.0 + x * (-5040.0 + x * (8400.0 - 4200.0 * x))),
    ]
}

impl Sine {
    /// The state at `time_s` after the start.
    pub fn at(&self, time_s: f64) -> Kinematics {
        let x = self.frequency_hz * time_s;
        let (sin, cos) = (TAU * x.fract()).sin_cos();
        let wave = [sin, TAU * cos, -TAU * TAU * sin, -TAU * TAU * TAU * cos];
        let [w0, w1, w2, w3] = wave;
        let [g0, g1, g2, g3] = if x < 1.0 {
            let [s0, s1, s2, s3] = ramp(x);
            [
                s0 * w0,
                s1 * w0 + s0 * w1,
                s2 * w0 + 2.0 * s1 * w1 + s0 * w2,
                s3 * w0 + 3.0 * s2 * w1 + 3.0 * s1 * w2 + s0 * w3,
            ]
        } else {
            wave
        };
        let rate = self.frequency_hz;
        Kinematics {
            angle_rad: self.centre_rad + self.amplitude_rad * g0,
            speed_rad_per_s: self.amplitude_rad * rate * g1,
            acceleration_rad_per_s2: self.amplitude_rad * rate * rate * g2,
            jerk_rad_per_s3: self.amplitude_rad * rate * rate * rate * g3,
        }
    }

    /// Whether the whole motion, ramp included, stays within the limits of motion and can be told from its samples.
    ///
    /// # Errors
    /// The limit that it would leave; `NoPlan` for the jerk, and for half the sampling rate and above.
    pub fn check(&self, params: &Params) -> Result<(), SetPointRefusal> {
        let limits: &Limits = &params.limits;
        let (size, rate) = (self.amplitude_rad.abs(), self.frequency_hz);
        let below = limits.min_angle_rad.is_some_and(|lowest| self.centre_rad - size < lowest);
        let above = limits.max_angle_rad.is_some_and(|highest| self.centre_rad + size > highest);
        // A comparison with NaN is false: what is not finite is refused by the last one.
        if below || above {
            Err(SetPointRefusal::AngleLimit)
        } else if size * rate * PEAK_SPEED > limits.max_speed_rad_per_s {
            Err(SetPointRefusal::SpeedLimit)
        } else if size * rate * rate * PEAK_ACCELERATION > limits.max_acceleration_rad_per_s2 {
            Err(SetPointRefusal::AccelerationLimit)
        } else if size * rate * rate * rate * PEAK_JERK <= limits.max_jerk_rad_per_s3
            && rate > 0.0
            && rate * params.period_s < 0.5
        {
            Ok(())
        } else {
            Err(SetPointRefusal::NoPlan)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peaks_are_those_of_the_formula() {
        let sine = Sine { centre_rad: 0.0, amplitude_rad: 1.0, frequency_hz: 1.0 };
        let mut peaks = [0.0_f64; 4];
        for i in 0..400_000 {
            let state = sine.at(f64::from(i) * 1e-5);
            let values = [
                state.angle_rad,
                state.speed_rad_per_s,
                state.acceleration_rad_per_s2,
                state.jerk_rad_per_s3,
            ];
            for (peak, value) in peaks.iter_mut().zip(values) {
                *peak = peak.max(value.abs());
            }
        }
        let stated = [1.0, PEAK_SPEED, PEAK_ACCELERATION, PEAK_JERK];
        for (peak, stated) in peaks.iter().zip(stated) {
            assert!(*peak <= stated && *peak > stated * (1.0 - 1e-7), "{peak}, stated {stated}");
        }
    }

    #[test]
    fn each_quantity_is_the_integral_of_the_next() {
        let sine = Sine { centre_rad: 0.3, amplitude_rad: -0.2, frequency_hz: 2.0 };
        let step_s = 1e-5;
        for i in 1..200_000 {
            let time_s = f64::from(i) * step_s;
            let (before, now, after) = (sine.at(time_s - step_s), sine.at(time_s), sine.at(time_s + step_s));
            let speed = (after.angle_rad - before.angle_rad) / (2.0 * step_s);
            let acceleration = (after.speed_rad_per_s - before.speed_rad_per_s) / (2.0 * step_s);
            let jerk = (after.acceleration_rad_per_s2 - before.acceleration_rad_per_s2) / (2.0 * step_s);
            assert!((speed - now.speed_rad_per_s).abs() < 1e-6);
            assert!((acceleration - now.acceleration_rad_per_s2).abs() < 1e-4);
            assert!((jerk - now.jerk_rad_per_s3).abs() < 1e-2);
        }
    }
}

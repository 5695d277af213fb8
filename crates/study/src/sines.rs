//! How large a sine may be within limits of motion.

use config::MotionLimits;

/// The largest sine that the limits of motion allow, the trajectory's start of it included, rad.
///
/// The start overshoots: speed by little more than (2πf)·A, acceleration by 1.15 times (2πf)²·A, jerk by 1.55 times (2πf)³·A.
pub fn largest_amplitude(limits: &MotionLimits, frequency_hz: f64) -> f64 {
    let by = |limit: f64, factor: f64, power: i32| limit / (factor * frequency_hz.powi(power));
    by(limits.max_speed_rad_per_s, 6.3, 1).min(by(limits.max_acceleration_rad_per_s2, 45.5, 2)).min(by(
        limits.max_jerk_rad_per_s3,
        385.0,
        3,
    ))
}

//! Checks of angles and motions against the limits, shared by the readers and the check with the models.

use crate::reader::Field;
use crate::scenario::MotionLimits;
use crate::units::Dimension;

/// Rounding of a unit's factor shall not make "90deg" exceed a limit of "0.25turn".
const ROUNDING: f64 = 1e-9;

/// Whether `value` exceeds `limit` by more than rounding; false for NaN.
fn exceeds(value: f64, limit: f64) -> bool {
    value - limit > ROUNDING * limit.abs()
}

/// "an angle within the limits, 0 deg to 45 deg".
pub(crate) fn angle_within(limits: &MotionLimits) -> String {
    let show = |angle: Option<f64>| {
        angle.map_or_else(|| "unlimited".to_owned(), |angle| Dimension::Angle.display(angle))
    };
    format!("an angle within [limits], {} to {}", show(limits.min_angle_rad), show(limits.max_angle_rad))
}

/// Whether an angle lies outside the limits by more than rounding; false for NaN.
pub(crate) fn angle_outside(angle_rad: f64, limits: &MotionLimits) -> bool {
    limits.max_angle_rad.is_some_and(|max| exceeds(angle_rad, max))
        || limits.min_angle_rad.is_some_and(|min| exceeds(-angle_rad, -min))
}

/// Reports an angle outside the limits.
pub(crate) fn refuse_angle_outside(field: &Field<'_>, angle_rad: f64, limits: &MotionLimits) {
    if angle_outside(angle_rad, limits) {
        let found = field.found();
        // 40 lies between -5 deg and 50 deg to who means degrees.
        let is_bare = found.parse::<f64>().is_ok();
        let found = if is_bare { format!("{found}, which is {found} rad without a unit") } else { found };
        field.refuse_as(found, angle_within(limits));
    }
}

/// A sine's greatest speed, acceleration and jerk over amplitude and powers of the frequency. It begins under a ramp of
/// one period, which raises acceleration and jerk above those of the sine itself (1.15 and 1.55 times): `trajectory`
/// refuses what exceeds these.
const PEAKS_OF_SINE: [f64; 3] = [std::f64::consts::TAU, 45.465_260, 384.737_302];

/// What a sine asks beyond the limits, in the words of "found … expected …".
pub(crate) fn sine_beyond_limits(
    amplitude_rad: f64,
    frequency_hz: f64,
    limits: &MotionLimits,
) -> Vec<(String, String)> {
    let [speed, acceleration, jerk] = PEAKS_OF_SINE;
    let peak = |factor: f64, power| factor * amplitude_rad * frequency_hz.powi(power);
    let peaks = [
        ("speed", Dimension::Speed, peak(speed, 1), limits.max_speed_rad_per_s),
        ("acceleration", Dimension::Acceleration, peak(acceleration, 2), limits.max_acceleration_rad_per_s2),
        ("jerk", Dimension::Jerk, peak(jerk, 3), limits.max_jerk_rad_per_s3),
    ];
    let broken = peaks.into_iter().filter(|&(_, _, peak, limit)| peak > limit);
    broken
        .map(|(name, dimension, peak, limit)| {
            let found = format!("a sine with a peak {name} of {}", dimension.display(peak));
            (found, format!("at most limits.max_{name}, {}", dimension.display(limit)))
        })
        .collect()
}

/// Reports a sine about a known centre that leaves the limits of the angle.
pub(crate) fn refuse_sine_outside(
    field: &Field<'_>,
    centre_rad: f64,
    amplitude_rad: f64,
    limits: &MotionLimits,
) {
    let (low, high) = (centre_rad - amplitude_rad, centre_rad + amplitude_rad);
    if angle_outside(low, limits) || angle_outside(high, limits) {
        let (low, high) = (Dimension::Angle.display(low), Dimension::Angle.display(high));
        field.refuse_as(format!("a sine from {low} to {high}"), angle_within(limits));
    }
}

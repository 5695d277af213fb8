//! How a simulated valve stands when its process begins: where a scenario puts it, or where it was left.

use serde::{Deserialize, Serialize};
use signals::{Feedback, PlantTruth, validity};

/// The valve, the drive's count and the encoder's zero at the beginning.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlantStart {
    /// The rotor's true angle, rad: it holds at multiples of a tooth pitch where the current's phase is zero.
    pub angle_rad: f64,
    /// The drive's count, micro-steps.
    pub count_microsteps: i64,
    /// How far the count is beyond the one that fixes the current's phase, micro-steps.
    pub rebased_microsteps: i64,
    /// What the encoder's angle is beyond the true one, rad.
    pub encoder_zero_rad: f64,
    /// Whether the angle's zero is known.
    pub homed: bool,
    /// Whether the windings carry current.
    pub energised: bool,
    /// The newest zero that the drive took.
    pub zero_id: u64,
    /// What friction holds, N·m: against it the rotor rests off the teeth.
    pub friction_torque_nm: f64,
}

impl PlantStart {
    /// Homed and aligned: count and encoder say the true angle.
    pub fn homed(angle_rad: f64, microstep_rad: f64) -> Self {
        Self {
            angle_rad,
            count_microsteps: (angle_rad / microstep_rad).round() as i64,
            rebased_microsteps: 0,
            encoder_zero_rad: 0.0,
            homed: true,
            energised: false,
            zero_id: 0,
            friction_torque_nm: 0.0,
        }
    }

    /// Just switched on: the driver begins at count and phase zero wherever the rotor is, and so does an encoder that is
    /// not absolute.
    pub fn switched_on(angle_rad: f64, absolute_encoder: bool) -> Self {
        Self {
            count_microsteps: 0,
            encoder_zero_rad: if absolute_encoder { 0.0 } else { -angle_rad },
            homed: false,
            ..Self::homed(angle_rad, 1.0)
        }
    }

    /// Where an earlier process left it, by its last messages. The count and its zero outlive the process in the drive;
    /// that the valve is homed only holds where current kept the rotor, or an absolute encoder sees where it went.
    pub fn left_by(
        feedback: &Feedback,
        truth: &PlantTruth,
        microstep_rad: f64,
        absolute_encoder: bool,
    ) -> Self {
        let has = |bit: u64| feedback.validity & bit != 0;
        let own_count = (truth.command_angle_rad / microstep_rad).round() as i64;
        let energised = has(validity::ENERGISED);
        Self {
            angle_rad: truth.angle_rad,
            count_microsteps: feedback.accepted_microsteps,
            rebased_microsteps: feedback.accepted_microsteps.saturating_sub(own_count),
            encoder_zero_rad: if has(validity::ENCODER) { truth.encoder_zero_rad } else { 0.0 },
            homed: has(validity::HOMED) && (energised || absolute_encoder),
            energised,
            zero_id: feedback.zero_id,
            friction_torque_nm: truth.friction_torque_nm,
        }
    }
}

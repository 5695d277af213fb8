//! What the instruments make of the truth: play and eccentricity of the encoder, gain and offset of the transducer.

use serde::{Deserialize, Serialize};

use crate::{EffectId, Model};

/// The model's effects of measurement, and steps that the rotor loses by itself; neutral where it has none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Measurement {
    pub backlash_half_width_rad: f64,
    eccentricity_rad: f64,
    eccentricity_phase_rad: f64,
    pub torque_gain: f64,
    torque_offset_nm: f64,
    pub delay: SensorDelay,
    missed: [MissedSteps; MAX_MISSED],
}

/// How late a channel is (effect `sensor-delay`).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SensorDelay {
    /// In all, s.
    pub delay_s: f64,
    /// The share of it that is the delay of a low-pass of order 2, damped at 1/√2; the rest delays all frequencies alike.
    pub low_pass_share: f64,
}

/// Tooth pitches that the rotor jumps by at one time of the run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct MissedSteps {
    time_s: f64,
    jump_rad: f64,
}

const MAX_MISSED: usize = 8;

impl Measurement {
    pub fn new(model: &Model, tooth_pitch_rad: f64) -> Self {
        let mut measurement = Self {
            backlash_half_width_rad: 0.0,
            eccentricity_rad: 0.0,
            eccentricity_phase_rad: 0.0,
            torque_gain: 1.0,
            torque_offset_nm: 0.0,
            delay: SensorDelay::default(),
            missed: [MissedSteps::default(); MAX_MISSED],
        };
        for effect in &model.effects {
            match effect.id() {
                EffectId::Backlash => measurement.backlash_half_width_rad = effect.number("half_width_rad"),
                EffectId::EncoderEccentricity => {
                    measurement.eccentricity_rad = effect.number("amplitude_rad");
                    measurement.eccentricity_phase_rad = effect.number("phase_rad");
                }
                EffectId::TorqueGain => measurement.torque_gain = effect.number("factor"),
                EffectId::TorqueOffset => measurement.torque_offset_nm = effect.number("offset_nm"),
                EffectId::SensorDelay => {
                    let low_pass_share = effect.number("low_pass_share");
                    measurement.delay = SensorDelay { delay_s: effect.number("delay_s"), low_pass_share };
                }
                EffectId::MissedSteps => {
                    let steps = effect.list("time_s").iter().zip(effect.list("teeth"));
                    for (slot, (time_s, teeth)) in measurement.missed.iter_mut().zip(steps) {
                        *slot = MissedSteps { time_s: *time_s, jump_rad: teeth * tooth_pitch_rad };
                    }
                }
                // These belong to the valve itself.
                EffectId::CoulombLevel
                | EffectId::StaticLevel
                | EffectId::ViscousLevel
                | EffectId::StribeckVelocity
                | EffectId::BristleStiffness
                | EffectId::BristleDamping
                | EffectId::RotorInertia
                | EffectId::MotorDamping
                | EffectId::LoadInertia
                | EffectId::HoldingTorqueLevel
                | EffectId::PressureDependentFriction
                | EffectId::TemperatureDependentViscosity
                | EffectId::TemperatureDependentFriction
                | EffectId::AngleDependentFriction
                | EffectId::DirectionAsymmetry
                | EffectId::DwellStiction
                | EffectId::HydraulicLock
                | EffectId::FrictionLag
                | EffectId::PreslidingHysteresis
                | EffectId::WearDrift
                | EffectId::FlowTorque
                | EffectId::PressureTorque
                | EffectId::PositionTorque
                | EffectId::CouplingCompliance
                | EffectId::DetentTorque
                | EffectId::MicrostepError
                | EffectId::Custom(_) => {}
            }
        }
        measurement
    }

    /// The encoder's own shaft follows the rotor with play.
    pub fn encoder_shaft_rad(&self, before_rad: f64, rotor_rad: f64) -> f64 {
        let play = self.backlash_half_width_rad;
        before_rad.max(rotor_rad - play).min(rotor_rad + play)
    }

    /// The angle that the encoder reads from its shaft.
    pub fn encoder_angle_rad(&self, shaft_rad: f64) -> f64 {
        if self.eccentricity_rad == 0.0 {
            return shaft_rad;
        }
        shaft_rad + self.eccentricity_rad * (shaft_rad + self.eccentricity_phase_rad).sin()
    }

    /// The shaft's angle under which the encoder reads `encoder_rad`; the eccentricity is far below a radian.
    pub fn shaft_under(&self, encoder_rad: f64) -> f64 {
        let mut shaft_rad = encoder_rad;
        for _ in 0..4 {
            shaft_rad -= self.encoder_angle_rad(shaft_rad) - encoder_rad;
        }
        shaft_rad
    }

    /// What the transducer makes of a torque.
    pub fn torque_nm(&self, torque_nm: f64) -> f64 {
        self.torque_gain * torque_nm + self.torque_offset_nm
    }

    /// The jumps of a cycle, rad: those after `start_s` and not after `end_s`.
    pub fn jump_rad(&self, start_s: f64, end_s: f64) -> f64 {
        let within = |step: &&MissedSteps| step.time_s > start_s && step.time_s <= end_s;
        self.missed.iter().filter(within).map(|step| step.jump_rad).sum()
    }
}

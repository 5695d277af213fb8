//! The hybrid stepper motor, quasi-static: T = T_hold·sin(N_r·(θ_cmd − θ)) − D·ω.
//!
//! θ and ω are the rotor's angle (rad) and speed (rad/s), θ_cmd the commanded angle (rad), N_r the number of rotor
//! teeth, T_hold the holding torque (N·m), D the damping (N·m·s/rad). Torque is positive with positive angle.

use std::f64::consts::{FRAC_PI_2, TAU};

use serde::{Deserialize, Serialize};

use crate::ParamError;
use crate::error::{count, not_negative, positive, require};

/// `[motor]`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotorParams {
    /// Number of phases.
    pub phases: u32,
    /// Rotor teeth N_r: electrical radians in a mechanical one.
    pub rotor_teeth: u32,
    /// Full steps in a turn: 2 × phases × teeth.
    pub full_steps_per_rev: u32,
    /// Micro-steps in a full step.
    pub microsteps_per_full_step: u32,
    /// Holding torque T_hold, N·m.
    pub holding_torque_nm: f64,
    /// Rotor inertia, kg·m².
    pub rotor_inertia_kg_m2: f64,
    /// Damping D of the motor itself, N·m·s/rad.
    pub damping_nm_s_per_rad: f64,
    /// The highest pulse rate that the driver takes, micro-steps per second.
    pub max_pulse_rate_hz: f64,
    /// Supply voltage of the driver, V. This and the next four: all, or none.
    pub supply_voltage_v: Option<f64>,
    /// Resistance of a phase, Ω.
    pub phase_resistance_ohm: Option<f64>,
    /// Inductance of a phase, H.
    pub phase_inductance_h: Option<f64>,
    /// Rated current of a phase, A.
    pub rated_current_a: Option<f64>,
    /// Torque constant of a phase, N·m/A; V·s/rad for the back-EMF.
    pub torque_constant_nm_per_a: Option<f64>,
}

/// The motor's electrical side: the five optional keys, all of them there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MotorElectrical {
    /// Supply voltage of the driver, V.
    pub supply_voltage_v: f64,
    /// Resistance of a phase, Ω.
    pub phase_resistance_ohm: f64,
    /// Inductance of a phase, H.
    pub phase_inductance_h: f64,
    /// Rated current of a phase, A.
    pub rated_current_a: f64,
    /// Torque constant of a phase, N·m/A.
    pub torque_constant_nm_per_a: f64,
}

/// The part of the holding torque that is left at speed: the current that the supply can drive through winding and
/// back-EMF, over the rated one.
///
/// A phase at the electrical speed N_r·ω with its current in phase with its back-EMF E = K_t·ω, where the torque is
/// greatest: (R·I + E)² + (N_r·ω·L·I)² = V². The current follows within a cycle, so the speed is the command's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct SpeedLimit {
    electrical: MotorElectrical,
    rotor_teeth: f64,
}

impl SpeedLimit {
    /// Between 0 and 1.
    pub fn torque_part(&self, speed_rad_per_s: f64) -> f64 {
        let electrical = &self.electrical;
        let speed = speed_rad_per_s.abs();
        let emf_v = electrical.torque_constant_nm_per_a * speed;
        let resistance = electrical.phase_resistance_ohm;
        let reactance = self.rotor_teeth * speed * electrical.phase_inductance_h;
        let left = electrical.supply_voltage_v * electrical.supply_voltage_v - emf_v * emf_v;
        if left <= 0.0 {
            return 0.0;
        }
        // (R² + X²)·I² + 2·R·E·I − left = 0, its positive root without cancellation.
        let impedance = resistance * resistance + reactance * reactance;
        let half = resistance * emf_v;
        let current_a = left / (half + (half * half + impedance * left).sqrt());
        (current_a / electrical.rated_current_a).min(1.0)
    }
}

impl MotorParams {
    pub(crate) fn speed_limit(&self) -> Option<SpeedLimit> {
        let rotor_teeth = f64::from(self.rotor_teeth);
        self.electrical().map(|electrical| SpeedLimit { electrical, rotor_teeth })
    }

    /// The greatest torque at a speed held, N·m: the holding torque where the electrical keys are absent, else what
    /// finite current rise and back-EMF leave of it.
    pub fn available_torque_nm(&self, speed_rad_per_s: f64) -> f64 {
        let part = self.speed_limit().map_or(1.0, |limit| limit.torque_part(speed_rad_per_s));
        self.holding_torque_nm * part
    }

    /// The speed at which the motor falls out of step under a load: the greatest at which `load_torque_nm` and the
    /// motor's own damping are still within [`Self::available_torque_nm`], rad/s, at most the driver's pulse rate's.
    /// `None` where the load is too much at rest already.
    pub fn pull_out_speed_rad_per_s(&self, load_torque_nm: f64) -> Option<f64> {
        let reserve_nm = |speed: f64| {
            self.available_torque_nm(speed) - load_torque_nm.abs() - self.damping_nm_s_per_rad * speed
        };
        let fastest = self.max_pulse_rate_hz * self.microstep_angle_rad();
        if reserve_nm(fastest) >= 0.0 {
            return Some(fastest);
        }
        let (mut held, mut lost) = (0.0, fastest);
        if reserve_nm(held) < 0.0 || !load_torque_nm.is_finite() {
            return None;
        }
        for _ in 0..60 {
            let middle = 0.5 * (held + lost);
            if reserve_nm(middle) >= 0.0 {
                held = middle;
            } else {
                lost = middle;
            }
        }
        Some(held)
    }

    /// The angle of one micro-step, rad.
    pub fn microstep_angle_rad(&self) -> f64 {
        TAU / (f64::from(self.full_steps_per_rev) * f64::from(self.microsteps_per_full_step))
    }

    /// The angle of one tooth: the rest positions repeat after it, rad.
    pub fn tooth_pitch_rad(&self) -> f64 {
        TAU / f64::from(self.rotor_teeth)
    }

    /// The quasi-static torque T_hold·sin(N_r·(θ_cmd − θ)) − D·ω, N·m.
    pub fn torque_nm(&self, command_rad: f64, angle_rad: f64, speed_rad_per_s: f64) -> f64 {
        let load_angle_rad = f64::from(self.rotor_teeth) * (command_rad - angle_rad);
        self.holding_torque_nm * load_angle_rad.sin() - self.damping_nm_s_per_rad * speed_rad_per_s
    }

    /// The lead N_r·(θ_cmd − θ), in electrical radians, at which the resting motor gives `torque_nm`, and whether that
    /// torque is beyond what it holds: the lead is then ±π/2, or 0 for a torque that is no number.
    pub fn lead_for_torque(&self, torque_nm: f64) -> (f64, bool) {
        let ratio = torque_nm / self.holding_torque_nm;
        if ratio.abs() <= 1.0 {
            (ratio.asin(), false)
        } else if ratio.is_nan() {
            (0.0, true)
        } else {
            (FRAC_PI_2.copysign(ratio), true)
        }
    }

    /// Tooth pitches between the command and the rest position that the rotor sits in, positive when the rotor is
    /// behind; a lost step is one of them, 7.2° for 50 teeth. 0 for angles that are no numbers.
    pub fn lost_steps(&self, command_rad: f64, angle_rad: f64) -> i64 {
        // `as` saturates, and takes NaN to zero.
        ((command_rad - angle_rad) / self.tooth_pitch_rad()).round() as i64
    }

    /// The electrical side; `None` unless all five keys are there.
    pub fn electrical(&self) -> Option<MotorElectrical> {
        Some(MotorElectrical {
            supply_voltage_v: self.supply_voltage_v?,
            phase_resistance_ohm: self.phase_resistance_ohm?,
            phase_inductance_h: self.phase_inductance_h?,
            rated_current_a: self.rated_current_a?,
            torque_constant_nm_per_a: self.torque_constant_nm_per_a?,
        })
    }

    /// Checks the section.
    ///
    /// # Errors
    /// The first number that no motor can have, or that contradicts another.
    pub fn validate(&self) -> Result<(), ParamError> {
        count("phases", self.phases, 2..=10, "2 to 10 phases")?;
        count("rotor_teeth", self.rotor_teeth, 1..=1000, "1 to 1000 teeth")?;
        let expected_steps = 2 * self.phases * self.rotor_teeth;
        count(
            "full_steps_per_rev",
            self.full_steps_per_rev,
            expected_steps..=expected_steps,
            "2 × `phases` × `rotor_teeth`",
        )?;
        count("microsteps_per_full_step", self.microsteps_per_full_step, 1..=100_000, "1 to 100000")?;
        positive("holding_torque_nm", self.holding_torque_nm)?;
        positive("rotor_inertia_kg_m2", self.rotor_inertia_kg_m2)?;
        not_negative("damping_nm_s_per_rad", self.damping_nm_s_per_rad)?;
        positive("max_pulse_rate_hz", self.max_pulse_rate_hz)?;
        self.validate_electrical()
    }

    fn validate_electrical(&self) -> Result<(), ParamError> {
        let keys = [
            ("supply_voltage_v", self.supply_voltage_v),
            ("phase_resistance_ohm", self.phase_resistance_ohm),
            ("phase_inductance_h", self.phase_inductance_h),
            ("rated_current_a", self.rated_current_a),
            ("torque_constant_nm_per_a", self.torque_constant_nm_per_a),
        ];
        let any = keys.iter().any(|(_, value)| value.is_some());
        for (key, value) in keys {
            match value {
                Some(value) => positive(key, value)?,
                None if any => {
                    return Err(ParamError::new(key, "missing", "all five electrical keys, or none"));
                }
                None => {}
            }
        }
        self.electrical().map_or(Ok(()), |electrical| {
            require(
                electrical.supply_voltage_v > electrical.rated_current_a * electrical.phase_resistance_ohm,
                "supply_voltage_v",
                electrical.supply_voltage_v,
                "more than `rated_current_a` × `phase_resistance_ohm`",
            )
        })
    }
}

//! The frequency response of the turning valve: how the spool answers to a small sine on its command, and to one on its
//! reference.

use super::cases::Case;
use anyhow::Result;
use closed_loop::{ControllerRole, Parts, PlantRole, TrajectoryRole, wire};
use config::{Compensation, Damping, ScheduledSetPoint, SetPoint};
use signals::{Reference, StepCommand};
use std::f64::consts::TAU;

/// The speed of turning, rad/s: well above stick-slip.
const SPEED_RAD_PER_S: f64 = 6.0;

/// Amplitude of the sine, rad.
const AMPLITUDE_RAD: f64 = 2e-4;

/// Cycles until the valve turns evenly, and cycles measured; every frequency below has whole periods in the second.
const BEFORE: u64 = 600;
const MEASURED: u64 = 1000;

/// The frequencies, Hz.
pub const FREQUENCIES_HZ: [f64; 14] =
    [5.0, 10.0, 20.0, 40.0, 60.0, 80.0, 100.0, 115.0, 123.0, 131.0, 150.0, 200.0, 300.0, 400.0];

/// A way to be excited, and what stands against it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Setting {
    /// A sine on the command, the law fed forward.
    Command(Damping),
    /// A sine on the reference, nothing fed forward.
    Reference(Damping),
}

/// The spool's amplitude over that of the sine, at each frequency.
///
/// # Errors
/// A case that can't be wired.
pub fn response(like: &Case, setting: Setting) -> Result<Vec<f64>> {
    let mut case = like.clone();
    let scenario = &mut case.scenario;
    (scenario.limits.min_angle_rad, scenario.limits.max_angle_rad) = (None, None);
    scenario.duration_s = (BEFORE + MEASURED) as f64 * scenario.period_s();
    let set_point = SetPoint::Speed { speed_rad_per_s: SPEED_RAD_PER_S };
    scenario.set_points = vec![ScheduledSetPoint { time_s: 0.05, set_point, line: 0 }];
    scenario.safety.max_following_error_rad = 1.0;
    let (Setting::Command(damping) | Setting::Reference(damping)) = setting;
    scenario.control.damping = damping;
    scenario.encoder.fitted = damping == Damping::Active;
    scenario.control.observer = damping == Damping::Active;
    let by_reference = matches!(setting, Setting::Reference(_));
    scenario.compensation = if by_reference { Compensation::None } else { Compensation::Full };
    let parts = wire(scenario, &case.truth, &case.truth)?;
    Ok(FREQUENCIES_HZ.iter().map(|frequency| amplitude(&parts, *frequency, by_reference)).collect())
}

fn amplitude(parts: &Parts, frequency_hz: f64, by_reference: bool) -> f64 {
    let mut plant = PlantRole::new(parts.plant.clone());
    let mut trajectory = TrajectoryRole::new(parts.trajectory.clone());
    let mut controller = ControllerRole::new(&parts.controller);
    let (mut command, mut status) = (None::<StepCommand>, None);
    let omega = TAU * frequency_hz;
    let period_s = parts.timeline.period_s();
    let first = parts.timeline.arm_cycle + BEFORE;
    let (mut sine, mut cosine) = (0.0, 0.0);
    for cycle in 0..first + MEASURED {
        let sample = plant.sample(cycle);
        let mut reference = trajectory.step(cycle, Some(&sample.feedback), status.as_ref(), None);
        if by_reference && cycle > parts.timeline.arm_cycle {
            excite(&mut reference, omega, (cycle + 2) as f64 * period_s);
        }
        let output = controller.step(cycle, Some(&sample.feedback), Some(&reference), None);
        plant.advance(cycle, command.as_ref());
        let mut next = output.command;
        if !by_reference && next.follow == 1 && cycle > parts.timeline.arm_cycle {
            let more_rad = AMPLITUDE_RAD * (omega * (cycle + 2) as f64 * period_s).sin();
            next.position_unrounded += more_rad / parts.plant.drive.microstep_angle_rad;
            next.position_microsteps = next.position_unrounded.round() as i64;
        }
        (command, status) = (Some(next), Some(output.status));
        if cycle >= first {
            // Turning evenly has no part in whole periods of the sine once its ramp is taken off.
            let even_rad = SPEED_RAD_PER_S * (cycle - first) as f64 * period_s;
            let deviation_rad = sample.truth.angle_rad - even_rad;
            let phase = omega * cycle as f64 * period_s;
            sine += deviation_rad * phase.sin();
            cosine += deviation_rad * phase.cos();
        }
    }
    2.0 * sine.hypot(cosine) / (MEASURED as f64 * AMPLITUDE_RAD)
}

fn excite(reference: &mut Reference, omega: f64, time_s: f64) {
    let (sine, cosine) = (omega * time_s).sin_cos();
    reference.angle_rad += AMPLITUDE_RAD * sine;
    reference.speed_rad_per_s += AMPLITUDE_RAD * omega * cosine;
    reference.acceleration_rad_per_s2 -= AMPLITUDE_RAD * omega * omega * sine;
    reference.jerk_rad_per_s3 -= AMPLITUDE_RAD * omega * omega * omega * cosine;
}

//! The identification run: a motion that shows every parameter of the friction law, and what drive and encoder say of it.

use closed_loop::{InProcess, WiringError, wire};
use config::{Compensation, Damping, Scenario, ScheduledSetPoint, SetPoint};
use signals::ControllerState;
use valve_model::Model;

/// The parts of the motion: length in s, and the sine (amplitude in rad, frequency in Hz).
///
/// Presliding, break-away, slow and fast sliding; each begins where the one before did. None lingers where sliding is
/// unstable: what the valve does there depends on the last digit of everything.
const PARTS: [(f64, f64, f64); 7] = [
    (1.5, 0.001, 2.0),
    (1.5, 0.003, 3.0),
    (2.5, 0.02, 5.0),
    (2.5, 0.05, 3.0),
    (2.5, 0.1, 2.0),
    (2.5, 0.2, 1.0),
    (2.5, 0.6, 3.0),
];

/// Rest between the parts, s.
const REST_S: f64 = 0.3;

/// What was seen in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The command at the cycle's beginning, rad.
    pub command_rad: f64,
    /// The encoder's reading there, rad.
    pub angle_rad: f64,
    /// Pressure drop, Pa.
    pub pressure_drop_pa: f64,
    /// Oil temperature, °C.
    pub oil_temperature_c: f64,
}

/// The scenario with the identification motion in place of its own, scaled down to its limits.
pub fn identification(scenario: &Scenario) -> Scenario {
    let mut scenario = scenario.clone();
    let limits = &scenario.limits;
    let room =
        |limit: Option<f64>| limit.map_or(f64::INFINITY, |limit| (limit - scenario.initial_angle_rad).abs());
    let room_rad = 0.95 * room(limits.min_angle_rad).min(room(limits.max_angle_rad));
    let mut time_s = REST_S;
    let mut set_points = Vec::new();
    for (length_s, amplitude_rad, frequency_hz) in PARTS {
        let most = largest_amplitude(limits, frequency_hz).min(room_rad);
        let amplitude_rad = amplitude_rad.min(most);
        set_points.push(ScheduledSetPoint {
            time_s,
            set_point: SetPoint::Sine { amplitude_rad, frequency_hz },
            line: 0,
        });
        time_s += length_s;
        // Back to where it began, so that the amplitudes always have their room.
        let angle_rad = scenario.initial_angle_rad;
        set_points.push(ScheduledSetPoint { time_s, set_point: SetPoint::Angle { angle_rad }, line: 0 });
        time_s += REST_S;
    }
    scenario.duration_s = time_s;
    scenario.set_points = set_points;
    // The lag of an uncompensated motion is what shows friction.
    scenario.compensation = Compensation::None;
    scenario.control.observer = false;
    scenario.control.damping = Damping::None;
    scenario
}

/// The largest sine that the limits of motion allow, the trajectory's start of it included, rad.
fn largest_amplitude(limits: &config::MotionLimits, frequency_hz: f64) -> f64 {
    let by = |limit: f64, factor: f64, power: i32| limit / (factor * frequency_hz.powi(power));
    by(limits.max_speed_rad_per_s, 6.3, 1).min(by(limits.max_acceleration_rad_per_s2, 45.5, 2)).min(by(
        limits.max_jerk_rad_per_s3,
        385.0,
        3,
    ))
}

/// Runs the motion in one thread and keeps what drive and encoder said while it ran; of the truth nothing else.
///
/// # Errors
/// A model that the scenario can't be wired with.
pub fn record(scenario: &Scenario, truth: &Model, belief: &Model) -> Result<Vec<Sample>, WiringError> {
    let parts = wire(scenario, truth, belief)?;
    let microstep_rad = parts.controller.params.drive.microstep_angle_rad;
    let seen = InProcess::new(&parts).filter(|cycle| cycle.status.state == ControllerState::Running.code());
    Ok(seen
        .map(|cycle| {
            let feedback = &cycle.plant.feedback;
            Sample {
                command_rad: feedback.accepted_microsteps as f64 * microstep_rad,
                angle_rad: feedback.angle_rad,
                pressure_drop_pa: feedback.pressure_drop_pa,
                oil_temperature_c: feedback.oil_temperature_c,
            }
        })
        .collect())
}

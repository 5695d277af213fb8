//! The identification motion: it shows every number of the friction law, and the load's inertia.

use campaign::record;
use closed_loop::{WiringError, wire};
use config::{Compensation, Damping, Scenario, ScheduledSetPoint, SetPoint};
use log_data::Log;
use study::largest_amplitude;
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

/// How often the motion is made: what is fitted to one is judged on another.
const TIMES: usize = 2;

/// The way to the middle of the angles, s.
const THERE_S: f64 = 1.5;

/// Rest between the parts, s.
const REST_S: f64 = 0.3;

/// The scenario with the identification motion in place of its own, scaled down to its limits.
pub fn identification(scenario: &Scenario) -> Scenario {
    let mut scenario = scenario.clone();
    let limits = &scenario.limits;
    // About the middle, where there is most room.
    let middle_rad = match (limits.min_angle_rad, limits.max_angle_rad) {
        (Some(least), Some(most)) => 0.5 * (least + most),
        _ => scenario.initial_angle_rad,
    };
    let room = |limit: Option<f64>| limit.map_or(f64::INFINITY, |limit| (limit - middle_rad).abs());
    let room_rad = 0.95 * room(limits.min_angle_rad).min(room(limits.max_angle_rad));
    let to_middle = SetPoint::Angle { angle_rad: middle_rad };
    let mut set_points = vec![ScheduledSetPoint { time_s: REST_S, set_point: to_middle, line: 0 }];
    let mut time_s = REST_S + THERE_S;
    for (length_s, amplitude_rad, frequency_hz) in PARTS.repeat(TIMES) {
        let most = largest_amplitude(limits, frequency_hz).min(room_rad);
        let amplitude_rad = amplitude_rad.min(most);
        set_points.push(ScheduledSetPoint {
            time_s,
            set_point: SetPoint::Sine { amplitude_rad, frequency_hz },
            line: 0,
        });
        time_s += length_s;
        // Back to the middle, so that the amplitudes always have their room.
        set_points.push(ScheduledSetPoint { time_s, set_point: to_middle, line: 0 });
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

/// Runs the motion in one thread: the log of what drive and encoder said while it ran.
///
/// # Errors
/// A model that the scenario can't be wired with.
pub fn made(scenario: &Scenario, truth: &Model, belief: &Model) -> Result<Log, WiringError> {
    Ok(record(&wire(scenario, truth, belief)?))
}

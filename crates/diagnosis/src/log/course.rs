//! Prediction of a whole run from its command, shared by the run's consecutive pieces: only the run's first state is
//! estimated.

use crate::log::driven::Driven;
use crate::log::initial_state::InitialState;
use crate::log::past::Before;
use valve_model::{ContactPast, MotionSample, ValveInput, ValveParams};

/// A whole run, to be predicted from its first sample on.
#[derive(Debug)]
pub(crate) struct WholeRun {
    /// The run's place in the log.
    pub run: usize,
    pub driven: Driven,
    pub first: MotionSample,
    /// The state of the contact before the run.
    pub past: Before,
}

/// The angles predicted from the command, rad, from the first sample of `driven` on, its lead included.
pub(crate) fn angle_rad(
    driven: &Driven,
    first: MotionSample,
    past: Before,
    params: &ValveParams,
    start: InitialState,
) -> Vec<f64> {
    let met_rad = first.angle_rad + start.shift;
    let input = |index: usize| {
        let (pressure_drop_pa, oil_temperature_c) = driven.conditions(index + 1);
        ValveInput {
            command_start_rad: driven.command_at(index),
            command_end_rad: driven.command_at(index + 1),
            pressure_drop_pa,
            oil_temperature_c,
            current_ratio: 1.0,
        }
    };
    let side = start.side.unwrap_or(past.side);
    let came_from_rad = side * params.friction_law().break_away_deflection_rad();
    let clock_s = driven.all_times_s().first().copied().unwrap_or(0.0);
    let past = ContactPast { came_from_rad, clock_s, ..past.contact };
    let mut state = params.met_at(met_rad, first.speed_rad_per_s, start.side, &input(0), &past);
    let mut angle = Vec::with_capacity(driven.all_times_s().len());
    angle.push(met_rad);
    for (index, times) in driven.all_times_s().windows(2).enumerate() {
        let dt_s = times.iter().fold(0.0, |before, after| after - before);
        angle.push(prediction::encoder_angle_after(params, &mut state, &input(index), dt_s));
    }
    prediction::delay(driven.all_times_s(), &mut angle, params.sensor_delay());
    angle
}

//! The angle that a command leads to, motor included.

use crate::conditions::{Conditions, whole};
use crate::delay::delay;
use crate::smoothing::motion_at;
use crate::{Noise, Past, Predicted, PredictionError, Start};
use log_data::{Channel, Run};
use valve_model::{ContactPast, Model, ParamError, ValveInput, ValveParams, ValveState, step};

/// The longest step that the integrator is asked for, s.
const LONGEST_S: f64 = 5e-3;

/// Moves `state` through `dt_s`, of any length, in pieces that the integrator is made for; the encoder's angle at its
/// end, rad.
pub fn encoder_angle_after(
    params: &ValveParams,
    state: &mut ValveState,
    input: &ValveInput,
    dt_s: f64,
) -> f64 {
    let pieces = (dt_s / LONGEST_S).ceil().max(1.0);
    let change_rad = input.command_end_rad - input.command_start_rad;
    let at = |piece: u64| input.command_start_rad + change_rad * piece as f64 / pieces;
    let mut angle_rad = f64::NAN;
    for piece in 0..pieces as u64 {
        let part = ValveInput { command_start_rad: at(piece), command_end_rad: at(piece + 1), ..*input };
        angle_rad = step(params, state, &part, dt_s / pieces).encoder_angle_rad;
    }
    angle_rad
}

/// Replaces the run's measured angle by what the model has for its command. The run begins where it was measured, its
/// bristles holding against the motor.
pub(crate) fn predict(
    run: &Run,
    model: &Model,
    past: &Past,
    angle_rad: &mut [f64],
) -> Result<Predicted, PredictionError> {
    let refused = |source: ParamError| PredictionError::Model { run: run.name.clone(), source };
    let params = ValveParams::new(model).map_err(refused)?;
    whole(run, Channel::Angle, angle_rad)?;
    let command_rad =
        whole(run, Channel::AngleCommand, run.angle_command_rad.as_deref().unwrap_or_default())?;
    let conditions = Conditions::of(run, model)?;
    let noise = Noise::of(angle_rad);
    let first = motion_at(&run.time_s, angle_rad, noise, 0);
    let contact =
        ContactPast { rest_s: past.rest_s, distance_rad: past.distance_rad, ..ContactPast::default() };
    let command = |index: usize| command_rad.get(index).copied().unwrap_or(f64::NAN);
    let input = |index: usize| {
        let (pressure_drop_pa, oil_temperature_c) = conditions.before(index + 1);
        ValveInput {
            command_start_rad: command(index),
            command_end_rad: command(index + 1),
            pressure_drop_pa,
            oil_temperature_c,
            energised: true,
        }
    };
    let mut state = params.met_at(first.angle_rad, first.speed_rad_per_s, None, &input(0), &contact);
    let deflection_rad = state.friction.bristle_deflection_rad();
    let predicted = angle_rad
        .iter_mut()
        .enumerate()
        .zip(run.time_s.windows(2))
        .map(|((index, angle), times)| (index, angle, times));
    let mut last = first.angle_rad;
    for (index, angle, times) in predicted {
        *angle = last;
        let dt_s = times.iter().fold(0.0, |before, after| after - before);
        last = encoder_angle_after(&params, &mut state, &input(index), dt_s);
    }
    if let Some(angle) = angle_rad.last_mut() {
        *angle = last;
    }
    delay(&run.time_s, angle_rad, params.sensor_delay_s());
    let end = state.friction.past();
    let start = Start::Estimated { deflection_rad, came_from_rad: 0.0 };
    Ok(Predicted {
        channel: Channel::Angle,
        start,
        left_out: 0,
        noise,
        end: Past { rest_s: end.rest_s, distance_rad: end.distance_rad },
    })
}

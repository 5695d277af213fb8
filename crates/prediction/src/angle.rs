//! The angle that a command leads to, motor included.

use crate::conditions::{Conditions, whole};
use crate::delay::delay;
use crate::sides::{SIDES, clearer};
use crate::smoothing::motion_at;
use crate::{Noise, Past, Predicted, PredictionError, Start};
use log_data::{Channel, Run};
use valve_model::{ContactPast, Model, MotionSample, ParamError, ValveInput, ValveParams, ValveState, step};

/// The longest step that the integrator is asked for, s.
const LONGEST_S: f64 = 5e-3;
/// Samples, at most, by which it is told where the bristles came from.
const START_SAMPLES: usize = 1000;

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
    let course = CommandedRun { time_s: &run.time_s, command_rad, conditions, params: &params, first, past };
    let came_from_rad = course.came_from_rad(angle_rad);
    let mut state = course.begin(came_from_rad);
    let start = Start::Estimated { deflection_rad: state.friction.bristle_deflection_rad(), came_from_rad };
    let mut last = first.angle_rad;
    for (index, angle) in angle_rad.iter_mut().enumerate() {
        if index > 0 {
            last = course.step(&mut state, index);
        }
        *angle = last;
    }
    delay(&run.time_s, angle_rad, params.sensor_delay());
    let end = state.friction.past();
    Ok(Predicted {
        channel: Channel::Angle,
        start,
        left_out: 0,
        noise,
        end: Past { rest_s: end.rest_s, distance_rad: end.distance_rad },
    })
}

/// A run's command through the model.
struct CommandedRun<'a> {
    time_s: &'a [f64],
    command_rad: &'a [f64],
    conditions: Conditions<'a>,
    params: &'a ValveParams,
    first: MotionSample,
    past: &'a Past,
}

impl CommandedRun<'_> {
    /// The valve at the run's first sample; its bristles came from a deflection.
    fn begin(&self, came_from_rad: f64) -> ValveState {
        let Past { rest_s, distance_rad } = *self.past;
        let clock_s = self.time_s.first().copied().unwrap_or(0.0);
        let past = ContactPast { came_from_rad, rest_s, distance_rad, clock_s, ..ContactPast::default() };
        self.params.met_at(self.first.angle_rad, self.first.speed_rad_per_s, None, &self.input(1), &past)
    }

    /// What drives the valve from the sample before `index` to it.
    fn input(&self, index: usize) -> ValveInput {
        let command = |index: usize| self.command_rad.get(index).copied().unwrap_or(f64::NAN);
        let (pressure_drop_pa, oil_temperature_c) = self.conditions.before(index);
        ValveInput {
            command_start_rad: command(index - 1),
            command_end_rad: command(index),
            pressure_drop_pa,
            oil_temperature_c,
            current_ratio: 1.0,
        }
    }

    /// Moves the valve from the sample before `index` to it; the encoder's angle there, rad.
    fn step(&self, state: &mut ValveState, index: usize) -> f64 {
        let at = |index: usize| self.time_s.get(index).copied().unwrap_or(f64::NAN);
        encoder_angle_after(self.params, state, &self.input(index), at(index) - at(index - 1))
    }

    /// Where bristles that remember it came from, as far as the first angles tell, rad.
    fn came_from_rad(&self, measured_rad: &[f64]) -> f64 {
        let law = self.params.friction_law();
        let sides: &[f64] = if law.has_memory() { &SIDES } else { &[] };
        let tried = |side: f64| {
            let came_from_rad = side * law.break_away_deflection_rad();
            (came_from_rad, self.misfit(came_from_rad, measured_rad))
        };
        clearer(tried(0.0), sides.iter().copied().map(tried), |(_, square)| *square).0
    }

    /// Sum of squares of predicted less measured angle over the first samples, rad².
    fn misfit(&self, came_from_rad: f64, measured_rad: &[f64]) -> f64 {
        let mut state = self.begin(came_from_rad);
        let first = measured_rad.iter().take(START_SAMPLES).enumerate().skip(1);
        first.map(|(index, measured)| (self.step(&mut state, index) - measured).powi(2)).sum()
    }
}

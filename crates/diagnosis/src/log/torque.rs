//! A torque predicted from a measured motion.

use crate::log::driven::Driven;
use crate::log::initial_state::InitialState;
use crate::log::inputs::Inputs;
use prediction::sharper;
use valve_model::{ContactPast, MotionInput, MotionParams, MotionSample, measured_motion_step};

/// The first sample's torque is taken after this time, s: practically at once.
const MOMENT_S: f64 = 1e-9;

/// The most that friction carries at rest under the conditions of a piece's first sample, N·m: the levels of the model with its
/// effects, not the nominal ones.
pub(crate) fn begins_with_nm(params: &MotionParams, driven: &Driven) -> f64 {
    let (pressure_drop_pa, oil_temperature_c) = driven.conditions(0);
    params.static_torque_at(pressure_drop_pa, oil_temperature_c)
}

/// The torque of each sample of a motion, N·m.
pub(crate) fn torque_nm(params: &MotionParams, inputs: &Inputs<'_>, start: InitialState) -> Vec<f64> {
    let Inputs { driven, motions, past, .. } = *inputs;
    let Some(first) = motions.first() else { return Vec::new() };
    let law = params.friction_law();
    let came_from_rad = start.side.unwrap_or(past.side) * law.break_away_deflection_rad();
    let deflection_rad = law.deflection_after_rad(came_from_rad, start.shift);
    let clock_s = driven.time_s().first().copied().unwrap_or(0.0);
    let past = ContactPast { deflection_rad, came_from_rad, clock_s, ..past.contact };
    let mut state = params.at_start_after(first, &past);
    let mut before = *first;
    let mut before_s = f64::NAN;
    let mut torque = Vec::with_capacity(motions.len());
    let times_s = driven.time_s();
    for (index, (motion, time_s)) in motions.iter().zip(times_s).enumerate() {
        let sharp = if params.is_behind_a_spring() { sharper_at(motions, times_s, index) } else { None };
        let motion = sharp.as_ref().unwrap_or(motion);
        let dt_s = if index == 0 { MOMENT_S } else { time_s - before_s };
        let (pressure_drop_pa, oil_temperature_c) = driven.conditions(index);
        let input = MotionInput { start: before, end: *motion, pressure_drop_pa, oil_temperature_c };
        torque.push(
            measured_motion_step(params, &mut state, (&input, inputs.deviation_rad), dt_s).measured_torque_nm,
        );
        (before, before_s) = (*motion, *time_s);
    }
    prediction::delay(times_s, &mut torque, params.sensor_delay());
    torque
}

/// A sample's motion with its speed corrected by the third derivative of the angle; `None` at the ends.
fn sharper_at(motions: &[MotionSample], time_s: &[f64], index: usize) -> Option<MotionSample> {
    let first = index.checked_sub(1)?;
    let (&[from_s, _, to_s], [before, at, after]) =
        (time_s.get(first..index + 2)?, motions.get(first..index + 2)?)
    else {
        return None;
    };
    Some(sharper(before, at, after, to_s - from_s))
}

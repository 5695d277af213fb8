//! Alignment, the end of homing: the offset between the encoder and the motor's teeth, and the new zero.
//!
//! The command goes through one electrical period and back in [`POINTS`] steps, and rests at each. Friction makes the rotor lag
//! on the way there and lead on the way back, so the mean of both is the offset between encoder and teeth. Its variation from
//! point to point (detent, micro-step error, a lost step) is the spread; too large a spread is refused.

use crate::homing_params::{Homing, HomingMethod};
use crate::homing_state::{HomingState, POINTS, ZeroShift};
use crate::params::Params;
use crate::state::State;
use drive::{Microsteps, MicrostepsPerCycle};
use signals::{FaultCode, Feedback, HomingPhase};
use std::f64::consts::TAU;

/// Time for which the rotor may swing before it is read at a rest, and time over which the reading is averaged, s.
const SWING_S: f64 = 0.03;
const READING_S: f64 = 0.01;

/// Steps of travel before the first rest and beyond the last: half an electrical period reverses the largest friction lag.
const TURN_STEPS: usize = POINTS / 2;

/// Time that the drive may take to move its zero, s.
const ZERO_S: f64 = 1.0;

/// A tooth pitch, rad.
pub(crate) fn tooth_rad(params: &Params) -> f64 {
    TAU / f64::from(params.motor.rotor_teeth)
}

/// Whether the command has reached its goal.
pub(crate) fn arrived(state: &State) -> bool {
    state.steering.position == state.homing.goal && state.steering.travel == MicrostepsPerCycle::ZERO
}

/// Reads the rotor at the rests of the way there and of the way back.
pub(crate) fn align(params: &Params, homing: &Homing, state: &mut State, feedback: &Feedback) -> FaultCode {
    if !arrived(state) {
        state.homing.rested_cycles = 0;
        return FaultCode::None;
    }
    let HomingState { rested_cycles, sum_rad, readings, .. } = &mut state.homing;
    *rested_cycles += 1;
    let rested_s = *rested_cycles as f64 * params.period_s;
    if rested_s > SWING_S {
        let command_rad = feedback.accepted_microsteps as f64 * params.drive.microstep_angle_rad;
        *sum_rad += feedback.angle_rad - command_rad;
        *readings += 1;
    }
    if rested_s <= SWING_S + READING_S {
        return FaultCode::None;
    }
    let lag_rad = *sum_rad / *readings as f64;
    (*sum_rad, *readings, *rested_cycles) = (0.0, 0, 0);
    next_rest(params, homing, state, lag_rad)
}

/// Notes a rest and goes on to the next; after the last one the teeth are aligned.
///
/// Points 1 to [`POINTS`] are the rests on the way there, the last [`POINTS`] those on the way back. Points 0 and [`POINTS`] +
/// 1 lie [`TURN_STEPS`] outside, so that friction lags in the direction of travel from there on.
fn next_rest(params: &Params, homing: &Homing, state: &mut State, lag_rad: f64) -> FaultCode {
    let rests = &mut state.homing;
    let there = 1..=POINTS;
    let back = POINTS + 2..=2 * POINTS + 1;
    if there.contains(&rests.point) {
        if let Some(place) = rests.lag_rad.get_mut(rests.point - 1) {
            *place = lag_rad;
        }
    } else if back.contains(&rests.point)
        && let Some(place) = rests.lag_rad.get_mut(2 * POINTS + 1 - rests.point)
    {
        *place = (*place + lag_rad) / 2.0;
    }
    rests.point += 1;
    if rests.point <= 2 * POINTS + 1 {
        let step = TURN_STEPS
            + match rests.point {
                point if point <= POINTS => point,
                point if point == POINTS + 1 => POINTS + TURN_STEPS,
                point => 2 * POINTS + 2 - point,
            };
        let tooth = tooth_rad(params) / params.drive.microstep_angle_rad;
        let way = -tooth * step as f64 / POINTS as f64 * homing.speed_rad_per_s.signum();
        rests.goal = Microsteps(rests.origin.0 + way);
        return FaultCode::None;
    }
    let mean_rad = rests.lag_rad.iter().sum::<f64>() / POINTS as f64;
    let spread_rad = rests.lag_rad.iter().fold(0.0_f64, |most, lag| most.max((lag - mean_rad).abs()));
    rests.offset_rad = mean_rad;
    rests.spread_rad = spread_rad;
    if spread_rad > homing.largest_spread_rad {
        return FaultCode::Homing;
    }
    set_zero(params, homing, state);
    FaultCode::None
}

/// Asks the drive for the zero at which the mark has its angle and the drive's count agrees with the encoder.
pub(crate) fn set_zero(params: &Params, homing: &Homing, state: &mut State) {
    let angle_rad = match homing.method {
        HomingMethod::Absolute => 0.0,
        _ => homing.angle_rad - state.homing.mark_rad,
    };
    let aligned = state.homing.point > 0;
    let count_rad = angle_rad + if aligned { state.homing.offset_rad } else { 0.0 };
    state.homing.goal = state.steering.position;
    state.homing.rested_cycles = 0;
    state.homing.phase = HomingPhase::SetZero;
    state.homing.shift = ZeroShift {
        id: state.homing.shift.id + 1,
        angle_rad,
        microsteps: (count_rad / params.drive.microstep_angle_rad).round() as i64,
    };
}

/// Waits until the drive counts from the new zero.
pub(crate) fn await_zero(params: &Params, state: &mut State, feedback: &Feedback) -> FaultCode {
    state.homing.rested_cycles += 1;
    if feedback.zero_id == state.homing.shift.id {
        state.homing.phase = HomingPhase::Done;
    } else if state.homing.rested_cycles as f64 * params.period_s > ZERO_S {
        return FaultCode::Homing;
    }
    FaultCode::None
}

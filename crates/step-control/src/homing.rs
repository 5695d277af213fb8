//! Homing: finds the angle's zero, then the offset between the motor's teeth and the encoder.
//!
//! ```text
//!        switch, stop                       index, absolute
//!  Seek ──▶ BackOff ──▶ Approach ──▶ Align ◀──────────── Seek
//!                          │           │
//!                          │ no encoder│ spread small
//!                          ▼           ▼
//!                              SetZero ──▶ Done
//! ```
//! The mark gives the zero. A switch is met twice, the second time slowly, so that its edge and not its delay counts.
//! A hard stop is where the rotor no longer follows at reduced current: the command's lead grows beyond the one of
//! sliding, or the rotor never slides at all. It is approached twice: friction above the reduced torque looks the
//! same, but hardly at the same angle twice. An index is latched by the encoder. `alignment` does the rest.

use crate::alignment::{align, arrived, await_zero, set_zero, tooth_rad};
use crate::homing_params::{Homing, HomingMethod};
use crate::homing_state::HomingState;
use crate::params::Params;
use crate::state::State;
use drive::{Microsteps, MicrostepsPerCycle};
use signals::{ControllerState, FaultCode, Feedback, HomingPhase, OperatorResult, validity};

/// A switch is approached at this part of the speed of the search.
const CREEP: f64 = 1.0 / 8.0;

/// At the hard stop the command leads the rotor by this more than in sliding, electrical rad.
const STALL_RAD: f64 = 50.0 * std::f64::consts::PI / 180.0;

/// The rotor counts as following if it covers this share of the command's travel in each `SLIDING_S`, s.
const SLIDING: f64 = 0.7;
const SLIDING_S: f64 = 0.02;

/// Tooth pitches that the command moves before what it leads the rotor by counts as the lead of sliding: while friction turns round, and
/// bristles with it, the rotor follows too, and the lead grows by up to half a pitch.
const TURNED_TEETH: f64 = 0.5;

/// Tooth pitches by which alignment stays away from the mark: a hard stop must not press on the rotor.
const CLEAR_TEETH: f64 = 1.0;

/// Tooth pitches by which a hard stop is left before it is met again.
const RETREAT_TEETH: f64 = 2.0;

/// The part of the holding torque that accelerates the command.
const ACCELERATION_PART: f64 = 1.0 / 16.0;

/// One cycle of homing; the fault that ends it, or none.
pub(crate) fn home(params: &Params, state: &mut State, cycle: u64, feedback: Option<&Feedback>) -> FaultCode {
    let Some(homing) = params.homing else { return FaultCode::Homing };
    let fault = feedback.map_or(FaultCode::None, |feedback| look(params, &homing, state, feedback));
    if state.homing.phase == HomingPhase::Done {
        state.conclude(OperatorResult::Done);
        state.enter(ControllerState::QuickStop, cycle);
    } else if fault == FaultCode::None {
        go(params, &homing, state);
    }
    fault
}

/// The part of the rated current that the motor shall have.
pub(crate) fn current_ratio(params: &Params, state: &State) -> f64 {
    let seeks = matches!(state.homing.phase, HomingPhase::Seek | HomingPhase::Approach);
    match params.homing {
        Some(homing) if seeks && homing.method == HomingMethod::Stop => homing.stop_current,
        _ => 1.0,
    }
}

/// Evaluates the mark, or the rests of the alignment, and goes on to the next phase.
fn look(params: &Params, homing: &Homing, state: &mut State, feedback: &Feedback) -> FaultCode {
    let met = match homing.method {
        HomingMethod::Switch => feedback.validity & validity::HOME_SWITCH != 0,
        HomingMethod::Stop => {
            state.homing.phase != HomingPhase::BackOff && stalled(params, homing, state, feedback)
        }
        HomingMethod::Index => feedback.validity & validity::INDEX != 0,
        HomingMethod::Absolute => true,
    };
    let reading_rad = match homing.method {
        HomingMethod::Stop => state.homing.furthest_rad,
        HomingMethod::Index => feedback.index_angle_rad,
        HomingMethod::Switch | HomingMethod::Absolute => feedback.angle_rad,
    };
    let twice = matches!(homing.method, HomingMethod::Switch | HomingMethod::Stop);
    let left = match homing.method {
        HomingMethod::Stop => arrived(state),
        _ => !met,
    };
    match state.homing.phase {
        HomingPhase::Seek if met && twice => {
            state.homing.mark_rad = reading_rad;
            state.homing.phase = HomingPhase::BackOff;
            let retreat_rad = match homing.method {
                HomingMethod::Stop => RETREAT_TEETH * tooth_rad(params),
                _ => homing.longest_rad,
            };
            state.homing.goal = beyond(params, homing, state, -retreat_rad);
        }
        HomingPhase::Seek if met => {
            mark(params, homing, state, reading_rad, feedback);
        }
        HomingPhase::BackOff if left => {
            state.homing.phase = HomingPhase::Approach;
            state.homing.goal = beyond(params, homing, state, homing.longest_rad);
            state.homing.from = state.steering.position;
            state.homing.sliding_lead_rad = None;
            state.homing.furthest_rad = feedback.angle_rad;
        }
        HomingPhase::Approach if met => {
            let moved_rad = (reading_rad - state.homing.mark_rad).abs();
            if homing.method == HomingMethod::Stop && moved_rad > homing.largest_spread_rad {
                return FaultCode::Homing;
            }
            mark(params, homing, state, reading_rad, feedback);
        }
        HomingPhase::Seek | HomingPhase::BackOff | HomingPhase::Approach if arrived(state) => {
            return FaultCode::Homing;
        }
        HomingPhase::Align => return align(params, homing, state, feedback),
        HomingPhase::SetZero => return await_zero(params, state, feedback),
        _ => {}
    }
    FaultCode::None
}

/// The position `way_rad` further in the direction of the search than the command.
fn beyond(params: &Params, homing: &Homing, state: &State, way_rad: f64) -> Microsteps {
    let way = way_rad / params.drive.microstep_angle_rad * homing.speed_rad_per_s.signum();
    Microsteps(state.steering.position.0 + way)
}

/// Whether the rotor stands against something: it slid and no longer does, or it has not slid while the command moved a tooth pitch.
fn stalled(params: &Params, homing: &Homing, state: &mut State, feedback: &Feedback) -> bool {
    let towards = homing.speed_rad_per_s.signum();
    let microstep_rad = params.drive.microstep_angle_rad;
    let command_rad = feedback.accepted_microsteps as f64 * microstep_rad;
    let lead_rad = towards * (command_rad - feedback.angle_rad);
    let HomingState { from, sliding_lead_rad, furthest_rad, looked_at_rad, looked_cycles, .. } =
        &mut state.homing;
    if towards * (feedback.angle_rad - *furthest_rad) > 0.0 {
        *furthest_rad = feedback.angle_rad;
    }
    *looked_cycles += 1;
    if *looked_cycles as f64 * params.period_s >= SLIDING_S {
        let (way_rad, moved_rad) = (command_rad - looked_at_rad.0, feedback.angle_rad - looked_at_rad.1);
        let has_turned = towards * (command_rad - from.0 * microstep_rad) > TURNED_TEETH * tooth_rad(params);
        if has_turned && towards * way_rad > 0.0 && towards * moved_rad > SLIDING * towards * way_rad {
            *sliding_lead_rad = Some(lead_rad);
        }
        (*looked_at_rad, *looked_cycles) = ((command_rad, feedback.angle_rad), 0);
    }
    match *sliding_lead_rad {
        Some(sliding_rad) => f64::from(params.motor.rotor_teeth) * (lead_rad - sliding_rad) > STALL_RAD,
        None => towards * (command_rad - from.0 * microstep_rad) > tooth_rad(params),
    }
}

/// Goes on once the mark is found: to the alignment, or to the new zero if there is no encoder to align.
fn mark(params: &Params, homing: &Homing, state: &mut State, mark_rad: f64, feedback: &Feedback) {
    state.homing.mark_rad = mark_rad;
    if feedback.validity & validity::ENCODER == 0 {
        set_zero(params, homing, state);
        return;
    }
    state.homing.phase = HomingPhase::Align;
    let clear_rad = match homing.method {
        HomingMethod::Absolute => 0.0,
        _ => CLEAR_TEETH * tooth_rad(params),
    };
    state.homing.origin = beyond(params, homing, state, -clear_rad);
    state.homing.goal = state.homing.origin;
}

/// Moves the command towards the goal at the phase's speed.
fn go(params: &Params, homing: &Homing, state: &mut State) {
    let speed_rad_per_s = match state.homing.phase {
        HomingPhase::Approach => CREEP * homing.speed_rad_per_s.abs(),
        _ => homing.speed_rad_per_s.abs(),
    };
    let microstep_rad = params.drive.microstep_angle_rad;
    let acceleration = ACCELERATION_PART * params.motor.holding_torque_nm / params.inertia_kg_m2;
    let slow = drive::Params {
        max_pulse_rate_hz: params.drive.max_pulse_rate_hz.min(speed_rad_per_s / microstep_rad),
        max_pulse_acceleration_hz_per_s: params
            .drive
            .max_pulse_acceleration_hz_per_s
            .min(acceleration / microstep_rad),
        ..params.drive
    };
    let steering = &mut state.steering;
    let travel =
        drive::follow(&slow, steering.position, steering.travel, state.homing.goal, MicrostepsPerCycle::ZERO);
    steering.position = travel.position;
    steering.travel = travel.way;
    steering.target = travel.position;
}

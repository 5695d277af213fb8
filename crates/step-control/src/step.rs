//! One cycle of the controller.

use crate::acceptance::note_accepted;
use crate::compensation::Wanted;
use crate::homing::{current_ratio, home};
use crate::homing_state::ZeroShift;
use crate::input::{Input, Output};
use crate::measure::measure;
use crate::orders::obey;
use crate::params::Params;
use crate::reception::{listen, pass_over};
use crate::state::State;
use crate::supervise::{settle, watch};
use crate::track::track;
use drive::MicrostepsPerCycle;
use signals::{Body, ControlStatus, ControllerState, FaultCode, Feedback, HomingPhase, StepCommand};

/// Takes the controller through cycle k.
pub fn step(params: &Params, state: &mut State, cycle: u64, input: &Input) -> Output {
    pass_over(params, state, cycle);
    listen(params, state, input);
    obey(params, state, cycle, input);
    note_accepted(params, state, input.feedback);
    measure(params, state, input.feedback);
    watch(params, state, cycle, input);
    if state.supervision.machine == ControllerState::Homing {
        let fault = home(params, state, cycle, input.feedback);
        if fault != FaultCode::None {
            state.fail(fault, cycle);
        }
    }
    match state.supervision.machine {
        ControllerState::Running => track(params, state),
        ControllerState::Homing => {}
        ControllerState::QuickStop => ramp_down(params, state),
        ControllerState::Disarmed | ControllerState::Arming | ControllerState::Fault => {
            stand(params, state, input.feedback);
        }
    }
    let command = command(params, state);
    // A reading that is wild but allowed makes differences that are not: without a clock a partner would wait for ever for a
    // status that it refuses.
    let status = status(state).clamped();
    settle(params, state, cycle, input.feedback);
    Output { command, status }
}

/// The same ramp that the drive makes by itself when it is no longer asked to follow.
fn ramp_down(params: &Params, state: &mut State) {
    let steering = &mut state.steering;
    steering.travel = drive::ramp_down(&params.drive, steering.travel);
    steering.position += steering.travel;
    rest(params, state);
}

fn stand(params: &Params, state: &mut State, feedback: Option<&Feedback>) {
    if let Some(feedback) = feedback {
        state.steering.position = feedback.accepted_microsteps.into();
    }
    state.steering.travel = MicrostepsPerCycle::ZERO;
    rest(params, state);
}

fn rest(params: &Params, state: &mut State) {
    let steering = &mut state.steering;
    steering.target = steering.position;
    steering.wanted = Wanted { reserve_nm: params.motor.holding_torque_nm, ..Wanted::default() };
    steering.limits = 0;
    steering.time_scale = 1.0;
}

fn command(params: &Params, state: &State) -> StepCommand {
    use ControllerState::{Arming, Disarmed, Fault, Homing, QuickStop, Running};
    let (machine, steering) = (state.supervision.machine, &state.steering);
    // A zero that was asked for is withdrawn if homing is ended before the drive has taken it: nobody expects it any more.
    let asks = machine == Homing || state.homing.phase == HomingPhase::Done;
    let shift = if asks { state.homing.shift } else { ZeroShift::default() };
    let energise = match machine {
        Arming | Running | Homing | QuickStop => true,
        Disarmed => params.holds_when_disarmed,
        Fault => params.drive.after_stop != drive::AfterStop::DeEnergise,
    };
    // While the drive moves its zero, it shall hold and not follow a count from the old zero.
    let homes = machine == Homing && state.homing.phase != HomingPhase::SetZero;
    let follows = machine == Running || homes;
    StepCommand {
        // The one place where micro-steps are rounded.
        position_microsteps: steering.position.round(),
        position_unrounded: steering.position.0,
        pulse_rate_hz: steering.travel.rate_hz(params.period_s),
        torque_feed_forward_nm: steering.wanted.torque_nm,
        follow: u64::from(follows),
        follow_id: if follows { state.supervision.armings } else { 0 },
        energise: u64::from(energise),
        current_ratio: if machine == Homing { current_ratio(params, state) } else { 1.0 },
        zero_id: shift.id,
        zero_shift_rad: shift.angle_rad,
        zero_shift_microsteps: shift.microsteps,
        zero_in_doubt: u64::from(state.supervision.zero_in_doubt),
    }
}

fn status(state: &State) -> ControlStatus {
    let State { supervision, reception, steering, observation, homing, .. } = state;
    let wanted = &steering.wanted;
    ControlStatus {
        state: supervision.machine.code(),
        fault: supervision.fault.code(),
        fault_cycle: if supervision.fault == FaultCode::None { 0 } else { supervision.fault_cycle },
        following_error_rad: observation.following_error_rad,
        following_error_peak_rad: observation.following_error_peak_rad,
        friction_estimate_nm: wanted.friction_nm,
        disturbance_estimate_nm: wanted.beyond_nm,
        wanted_torque_nm: wanted.torque_nm,
        lead_angle_rad: wanted.lead_rad,
        torque_reserve_nm: wanted.reserve_nm,
        limiting: steering.limits,
        alarms: observation.alarms.raised(),
        load_angle_rad: observation.load_angle_rad.unwrap_or_default(),
        missed_commands: observation.missed_commands,
        time_scale: steering.time_scale,
        lost_teeth: observation.recovery.lost_teeth,
        tooth_offset: observation.recovery.teeth,
        operator_id: supervision.operator_id,
        operator_result: supervision.operator_result.code(),
        homing_phase: homing.phase.code(),
        alignment_offset_rad: homing.offset_rad,
        alignment_spread_rad: homing.spread_rad,
        feedback_silent_cycles: reception.feedback.silent_cycles(),
        reference_silent_cycles: reception.reference.silent_cycles(),
    }
}

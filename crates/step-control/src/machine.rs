//! The state machine: arming, disarming, faults, reset.

use crate::compensation::{Contact, FeedForward, torque_beyond_nm};
use crate::correction::Instant;
use crate::params::{LostSteps, Params};
use crate::recovery::Recovery;
use crate::state::State;
use crate::step::Input;
use crate::way_back::WayBack;
use signals::{
    ControlParameter, ControllerState, FaultCode, Feedback, OperatorCommand, OperatorKind, OperatorResult,
    Reference, validity,
};

/// Carries out what the operator, or the scenario in the operator's place, wants in this cycle.
pub(crate) fn obey(
    params: &Params,
    state: &mut State,
    cycle: u64,
    feedback: Option<&Feedback>,
    order: Option<&OperatorCommand>,
) {
    if params.arm_at_cycle == Some(cycle) {
        carry_out(params, state, OperatorKind::Arm, feedback);
    }
    if params.disarm_at_cycle == Some(cycle) {
        carry_out(params, state, OperatorKind::Disarm, feedback);
    }
    let Some(order) = order.filter(|order| order.id > state.operator_id) else { return };
    state.operator_id = order.id;
    let kind = OperatorKind::from_code(order.kind).unwrap_or(OperatorKind::Nothing);
    state.operator_result = if kind == OperatorKind::SetParameter {
        let parameter = ControlParameter::from_code(order.parameter).unwrap_or(ControlParameter::None);
        state.tuning.set(params, parameter, order.value)
    } else {
        carry_out(params, state, kind, feedback)
    };
}

fn carry_out(
    params: &Params,
    state: &mut State,
    kind: OperatorKind,
    feedback: Option<&Feedback>,
) -> OperatorResult {
    use ControllerState::{Disarmed, Fault, QuickStop, Running};
    match (kind, state.machine) {
        (OperatorKind::Nothing | OperatorKind::SetParameter, _) => OperatorResult::None,
        (OperatorKind::Arm, Disarmed) => arm(params, state, feedback),
        (OperatorKind::Disarm, Running) => {
            state.machine = QuickStop;
            OperatorResult::Done
        }
        (OperatorKind::Disarm, Disarmed) | (OperatorKind::Arm, Running) => OperatorResult::Done,
        (OperatorKind::Reset, Fault) => {
            state.machine = Disarmed;
            state.fault = FaultCode::None;
            state.following_error_peak_rad = 0.0;
            OperatorResult::Done
        }
        (OperatorKind::Disarm | OperatorKind::Reset, QuickStop) | (OperatorKind::Arm, QuickStop | Fault) => {
            OperatorResult::WrongState
        }
        (OperatorKind::Reset, Disarmed | Running) | (OperatorKind::Disarm, Fault) => {
            OperatorResult::WrongState
        }
    }
}

/// Running begins where the valve stands: from the drive's own position while it holds, else (nothing holds the
/// rotor) from the measured angle.
fn arm(params: &Params, state: &mut State, feedback: Option<&Feedback>) -> OperatorResult {
    let Some(feedback) = feedback.filter(|_| state.reference.silent_cycles() == 0) else {
        return OperatorResult::NotReady;
    };
    let still = feedback.validity & validity::STANDSTILL != 0;
    if !still || feedback.drive_fault != FaultCode::None.code() {
        return OperatorResult::NotReady;
    }
    state.position = if feedback.validity & validity::ENERGISED != 0 {
        feedback.accepted_microsteps as f64
    } else {
        (feedback.angle_rad / params.drive.microstep_angle_rad).round()
    };
    begin(params, state, feedback);
    state.machine = ControllerState::Running;
    OperatorResult::Done
}

/// Forgets all that was, and begins at rest.
fn begin(params: &Params, state: &mut State, feedback: &Feedback) {
    let reference = Reference { speed_rad_per_s: 0.0, acceleration_rad_per_s2: 0.0, ..*state.window.now() };
    let command_rad = state.position * params.drive.microstep_angle_rad;
    let seen = feedback.validity & validity::ENCODER != 0;
    let lag_rad = f64::from(params.motor.rotor_teeth) * (command_rad - feedback.angle_rad);
    state.target = state.position;
    state.target_before = state.position;
    state.travel = 0.0;
    state.contact = Contact::relaxed();
    state.aim = reference;
    state.shaped.fill(&reference);
    state.recovery = Recovery::begin(if seen { lag_rad } else { 0.0 });
    state.following_error_peak_rad = 0.0;
    state.load_angle_rad = None;
    state.lost = false;
    state.unheard_cycles = 0;
    state.leapt = false;
    state.sets_out = false;
    state.way_back = WayBack::default();
    state.led = reference;
    state.time_scale = 1.0;
    let beyond_nm = torque_beyond_nm(params, state.position, &reference, &FeedForward::default());
    let reference_rad = reference.angle_rad;
    state.correction.begin(Instant { reference_rad, beyond_nm, command_rad });
}

/// Looks for a reason to stop, while running.
pub(crate) fn watch(params: &Params, state: &mut State, cycle: u64, input: &Input) {
    if state.machine != ControllerState::Running {
        return;
    }
    let limit = params.drive.silence_cycles;
    let fault = if state.feedback.silent(limit) {
        FaultCode::FeedbackSilent
    } else if state.reference.silent(limit) {
        FaultCode::ReferenceSilent
    } else if state.leapt
        || input.reference.is_some_and(|reference| params.reference_limits.exceeded(reference))
    {
        FaultCode::ReferenceLimit
    } else {
        input.feedback.map_or(FaultCode::None, |feedback| fault_of(params, state, feedback))
    };
    if fault != FaultCode::None {
        state.fault = fault;
        state.fault_cycle = cycle;
        state.machine = ControllerState::QuickStop;
    }
}

fn fault_of(params: &Params, state: &State, feedback: &Feedback) -> FaultCode {
    if feedback.drive_fault != FaultCode::None.code() {
        return FaultCode::Drive;
    }
    if state.lost {
        return match params.lost_steps {
            LostSteps::Fault => FaultCode::LostSteps,
            LostSteps::Resynchronise => FaultCode::None,
        };
    }
    let limit_rad = state.tuning.following_error_limit_rad(params, state.window.now().speed_rad_per_s);
    // Against what the command aimed at: what it catches up, or is late by because it is shaped, is no error of following.
    if state.behind_aim_rad.abs() > limit_rad {
        return FaultCode::FollowingError;
    }
    FaultCode::None
}

/// Ends a quick stop once command and drive stand still; a drive that is not heard of counts as still, since it stops
/// by itself.
pub(crate) fn settle(params: &Params, state: &mut State, feedback: Option<&Feedback>) {
    let silent = state.feedback.silent(params.drive.silence_cycles);
    let still = feedback.map_or(silent, |feedback| feedback.validity & validity::STANDSTILL != 0);
    if state.machine == ControllerState::QuickStop && state.travel == 0.0 && still {
        let disarmed = state.fault == FaultCode::None;
        state.machine = if disarmed { ControllerState::Disarmed } else { ControllerState::Fault };
    }
}

//! The state machine: arming, disarming, faults, reset.

use crate::input::Input;
use crate::params::{LostSteps, Params};
use crate::state::{State, Steering};
use drive::{Microsteps, MicrostepsPerCycle};
use signals::{
    ControlParameter, ControllerState, FaultCode, Feedback, Kinematics, OperatorCommand, OperatorKind,
    OperatorResult, validity,
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
    let Some(order) = order.filter(|order| order.id > state.supervision.operator_id) else { return };
    state.supervision.operator_id = order.id;
    let kind = OperatorKind::from_code(order.kind).unwrap_or(OperatorKind::Nothing);
    state.supervision.operator_result = if kind == OperatorKind::SetParameter {
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
    let supervision = &mut state.supervision;
    match (kind, supervision.machine) {
        (OperatorKind::Nothing | OperatorKind::SetParameter, _) => OperatorResult::None,
        (OperatorKind::Arm, Disarmed) => arm(params, state, feedback),
        (OperatorKind::Disarm, Running) => {
            supervision.machine = QuickStop;
            OperatorResult::Done
        }
        (OperatorKind::Disarm, Disarmed) | (OperatorKind::Arm, Running) => OperatorResult::Done,
        (OperatorKind::Reset, Fault) => {
            supervision.machine = Disarmed;
            supervision.fault = FaultCode::None;
            state.observation.following_error_peak_rad = 0.0;
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
    let Some(feedback) = feedback.filter(|_| state.reception.reference.silent_cycles() == 0) else {
        return OperatorResult::NotReady;
    };
    let still = feedback.validity & validity::STANDSTILL != 0;
    if !still || feedback.drive_fault != FaultCode::None.code() {
        return OperatorResult::NotReady;
    }
    let position = if feedback.validity & validity::ENERGISED != 0 {
        feedback.accepted_microsteps.into()
    } else {
        Microsteps((feedback.angle_rad / params.drive.microstep_angle_rad).round())
    };
    begin(params, state, position, feedback);
    state.supervision.machine = ControllerState::Running;
    OperatorResult::Done
}

/// Begins at rest with the command at `position`; of what was before only orders, tuning and surroundings remain.
fn begin(params: &Params, state: &mut State, position: Microsteps, feedback: &Feedback) {
    let now = state.reception.window.now();
    let reference = Kinematics { speed_rad_per_s: 0.0, acceleration_rad_per_s2: 0.0, ..*now };
    state.reception = state.reception.begun();
    state.steering = Steering::at(position, reference);
    state.observation = state.observation.begun(params, &state.steering, feedback);
}

/// Looks for a reason to stop, while running.
pub(crate) fn watch(params: &Params, state: &mut State, cycle: u64, input: &Input) {
    if state.supervision.machine != ControllerState::Running {
        return;
    }
    let (limit, reception) = (params.drive.silence_cycles, &state.reception);
    let fault = if reception.feedback.silent(limit) {
        FaultCode::FeedbackSilent
    } else if reception.reference.silent(limit) {
        FaultCode::ReferenceSilent
    } else if reception.leapt
        || input.reference.is_some_and(|reference| params.reference_limits.exceeded(reference))
    {
        FaultCode::ReferenceLimit
    } else {
        input.feedback.map_or(FaultCode::None, |feedback| fault_of(params, state, feedback))
    };
    if fault != FaultCode::None {
        state.supervision.fault = fault;
        state.supervision.fault_cycle = cycle;
        state.supervision.machine = ControllerState::QuickStop;
    }
}

fn fault_of(params: &Params, state: &State, feedback: &Feedback) -> FaultCode {
    if feedback.drive_fault != FaultCode::None.code() {
        return FaultCode::Drive;
    }
    if state.observation.lost {
        return match params.lost_steps {
            LostSteps::Fault => FaultCode::LostSteps,
            LostSteps::Resynchronise => FaultCode::None,
        };
    }
    let speed_rad_per_s = state.reception.window.now().speed_rad_per_s;
    let limit_rad = state.tuning.following_error_limit_rad(params, speed_rad_per_s);
    // Against what the command aimed at: the lag of a shaper or of a re-entry ramp is intended.
    if state.observation.behind_aim_rad.abs() > limit_rad {
        return FaultCode::FollowingError;
    }
    FaultCode::None
}

/// Ends a quick stop once command and drive stand still; a drive that is silent counts as still, since it stops by
/// itself.
pub(crate) fn settle(params: &Params, state: &mut State, feedback: Option<&Feedback>) {
    let silent = state.reception.feedback.silent(params.drive.silence_cycles);
    let still = feedback.map_or(silent, |feedback| feedback.validity & validity::STANDSTILL != 0);
    let stands = state.steering.travel == MicrostepsPerCycle::ZERO && still;
    if state.supervision.machine == ControllerState::QuickStop && stands {
        let disarmed = state.supervision.fault == FaultCode::None;
        state.supervision.machine = if disarmed { ControllerState::Disarmed } else { ControllerState::Fault };
    }
}

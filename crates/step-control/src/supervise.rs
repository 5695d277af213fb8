//! The state machine beside the operator's orders: arming that ends, faults that stop the valve, stops that end.

use crate::input::Input;
use crate::params::{LostSteps, Params};
use crate::state::{State, Steering};
use drive::MicrostepsPerCycle;
use signals::{ControllerState, FaultCode, Feedback, Kinematics, OperatorResult, validity};

/// Time that the drive may take to energise the motor and to hold it still, s. Real drives take up to half a second.
const ARMING_S: f64 = 2.0;

impl State {
    /// Goes to another state of the state machine.
    pub(crate) fn enter(&mut self, next: ControllerState, cycle: u64) {
        self.supervision.machine = next;
        self.supervision.since_cycle = cycle;
    }

    /// Stops the valve for a reason that is kept until reset. The order under way has failed.
    pub(crate) fn fail(&mut self, fault: FaultCode, cycle: u64) {
        self.supervision.fault = fault;
        self.supervision.fault_cycle = cycle;
        // The encoder and the count contradict each other by whole teeth; which of them is right, nobody knows.
        self.supervision.zero_in_doubt |= fault == FaultCode::LostSteps;
        self.conclude(OperatorResult::Failed);
        self.enter(ControllerState::QuickStop, cycle);
    }

    /// Answers the order that is under way.
    pub(crate) fn conclude(&mut self, result: OperatorResult) {
        if self.supervision.operator_result == OperatorResult::Begun {
            self.supervision.operator_result = result;
        }
    }
}

/// Looks for a reason to stop, and ends arming once the drive holds.
pub(crate) fn watch(params: &Params, state: &mut State, cycle: u64, input: &Input) {
    let fault = match state.supervision.machine {
        ControllerState::Running => running_fault(params, state, input),
        ControllerState::Homing => partner_fault(params, state, input),
        ControllerState::Arming => arming_fault(params, state, cycle, input),
        ControllerState::Disarmed | ControllerState::QuickStop | ControllerState::Fault => FaultCode::None,
    };
    if fault != FaultCode::None {
        state.fail(fault, cycle);
    } else if state.supervision.machine == ControllerState::Arming
        && let Some(feedback) = input.feedback
        && input.reference.is_some()
        && holds(feedback)
    {
        begin(params, state, cycle, feedback);
    }
}

/// Whether the motor is energised and stands.
fn holds(feedback: &Feedback) -> bool {
    const HOLDS: u64 = validity::ENERGISED | validity::STANDSTILL;
    feedback.validity & HOLDS == HOLDS
}

fn arming_fault(params: &Params, state: &State, cycle: u64, input: &Input) -> FaultCode {
    let partner = partner_fault(params, state, input);
    if partner != FaultCode::None {
        return partner;
    }
    let since_s = cycle.saturating_sub(state.supervision.since_cycle) as f64 * params.period_s;
    if since_s > ARMING_S { FaultCode::NotEnergised } else { FaultCode::None }
}

/// A partner that is silent, or a drive that has stopped by itself.
fn partner_fault(params: &Params, state: &State, input: &Input) -> FaultCode {
    let limit = params.drive.silence_cycles;
    if state.reception.feedback.silent(limit) {
        FaultCode::FeedbackSilent
    } else if state.reception.reference.silent(limit) {
        FaultCode::ReferenceSilent
    } else if input.feedback.is_some_and(|feedback| feedback.drive_fault != FaultCode::None.code()) {
        FaultCode::Drive
    } else {
        FaultCode::None
    }
}

fn running_fault(params: &Params, state: &State, input: &Input) -> FaultCode {
    let partner = partner_fault(params, state, input);
    if partner != FaultCode::None {
        return partner;
    }
    let (limits, homed) = (&params.reference_limits, state.reception.homed);
    if state.reception.leapt || input.reference.is_some_and(|reference| limits.exceeded(reference, homed)) {
        return FaultCode::ReferenceLimit;
    }
    input.feedback.map_or(FaultCode::None, |_| following_fault(params, state))
}

fn following_fault(params: &Params, state: &State) -> FaultCode {
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

/// Begins at rest where the drive holds the motor. Steering and observation start anew; only the surroundings are kept.
fn begin(params: &Params, state: &mut State, cycle: u64, feedback: &Feedback) {
    state.supervision.armings = state.supervision.armings.saturating_add(1);
    let now = state.reception.window.now();
    let reference = Kinematics { speed_rad_per_s: 0.0, acceleration_rad_per_s2: 0.0, ..*now };
    state.reception = state.reception.begun();
    state.steering = Steering::at(feedback.accepted_microsteps.into(), reference);
    if !state.reception.homed {
        // The offset of teeth to encoder is unknown before homing; the present lag is good enough for slow jogging.
        let count_rad = feedback.accepted_microsteps as f64 * params.drive.microstep_angle_rad;
        state.steering.offset_rad = feedback.angle_rad - count_rad;
    }
    state.observation = state.observation.begun(params, &state.steering, feedback);
    match params.homing.filter(|_| state.supervision.arms_to_home) {
        Some(homing) => {
            state.homing = state.homing.begun(params, &homing, feedback);
            state.enter(ControllerState::Homing, cycle);
        }
        None => {
            state.enter(ControllerState::Running, cycle);
            state.conclude(OperatorResult::Done);
        }
    }
}

/// Ends a quick stop once command and drive stand still; a drive that is silent counts as still, since it stops by
/// itself. One that does not come to rest in time is a fault: nothing shall wait for ever.
pub(crate) fn settle(params: &Params, state: &mut State, cycle: u64, feedback: Option<&Feedback>) {
    if state.supervision.machine != ControllerState::QuickStop
        || state.steering.travel != MicrostepsPerCycle::ZERO
    {
        return;
    }
    let silent = state.reception.feedback.silent(params.drive.silence_cycles);
    let still = feedback.map_or(silent, |feedback| feedback.validity & validity::STANDSTILL != 0);
    let late = !still && cycle.saturating_sub(state.supervision.since_cycle) > latest_rest_cycles(params);
    if late && state.supervision.fault == FaultCode::None {
        state.supervision.fault = FaultCode::NeverRests;
        state.supervision.fault_cycle = cycle;
    }
    if still || late {
        let disarmed = state.supervision.fault == FaultCode::None;
        state.enter(if disarmed { ControllerState::Disarmed } else { ControllerState::Fault }, cycle);
    }
}

/// The longest quick stop, in cycles: the drive's own stop, and the time that a rotor may take to rest on the motor.
fn latest_rest_cycles(params: &Params) -> u64 {
    let resting = (ARMING_S / params.period_s).ceil() as u64;
    drive::stop_cycles_bound(&params.drive).saturating_add(resting)
}

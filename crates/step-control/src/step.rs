//! One cycle of the controller.

use crate::compensation::{Surroundings, Wanted};
use crate::machine::{obey, settle, watch};
use crate::params::Params;
use crate::state::State;
use crate::track::{go_on, set_out_from_aim, track};
use signals::{
    ControlStatus, ControllerState, FaultCode, Feedback, OperatorCommand, Reference, StepCommand, validity,
};
use std::f64::consts::TAU;

/// What arrived in cycle k, already checked.
#[derive(Debug, Clone, Copy, Default)]
pub struct Input<'a> {
    /// Feedback k.
    pub feedback: Option<&'a Feedback>,
    /// Reference k+2.
    pub reference: Option<&'a Reference>,
    /// A new order of the operator's.
    pub order: Option<&'a OperatorCommand>,
}

/// What goes out in cycle k.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// StepCommand k+1.
    pub command: StepCommand,
    /// ControlStatus k.
    pub status: ControlStatus,
}

/// Takes the controller through cycle k.
pub fn step(params: &Params, state: &mut State, cycle: u64, input: &Input) -> Output {
    pass_over(params, state, cycle);
    listen(params, state, input);
    obey(params, state, cycle, input.feedback, input.order);
    measure(params, state, input.feedback);
    watch(params, state, cycle, input);
    match state.machine {
        ControllerState::Running => track(params, state),
        ControllerState::QuickStop => ramp_down(params, state),
        ControllerState::Disarmed | ControllerState::Fault => stand(params, state, input.feedback),
    }
    let command = command(params, state);
    let status = status(state);
    settle(params, state, input.feedback);
    Output { command, status }
}

/// Cycles that this process overran: no command went out, so the drive went on at the last rate. What the controller
/// remembers goes on likewise, or it would take the way of many cycles for the torque of one.
fn pass_over(params: &Params, state: &mut State, cycle: u64) {
    let passed = state.last_cycle.map_or(0, |last| cycle.saturating_sub(last).saturating_sub(1));
    state.last_cycle = Some(cycle);
    state.unheard_cycles = state.unheard_cycles.saturating_add(passed);
    // Beyond the silence limit the drive has stopped by itself, and says so.
    let running = state.machine == ControllerState::Running;
    for _ in 0..passed.min(params.drive.silence_cycles) {
        state.window.shift(None, params.period_s);
        if running {
            go_on(params, state);
        }
    }
    if running && passed > 0 {
        set_out_from_aim(params, state);
    }
}

fn listen(params: &Params, state: &mut State, input: &Input) {
    state.feedback.note(input.feedback.is_some());
    state.reference.note(input.reference.is_some());
    hear(params, state, input.reference);
    state.window.shift(input.reference, params.period_s);
    if state.machine != ControllerState::Running
        && let Some(reference) = input.reference
    {
        // Nothing moved before: the first reference after arming has no history.
        state.window.fill(reference);
    }
    if let Some(feedback) = input.feedback {
        note_surroundings(&mut state.surroundings, feedback);
    }
}

/// What went by unheard does not lead from the reference before to this one.
fn hear(params: &Params, state: &mut State, reference: Option<&Reference>) {
    state.leapt = false;
    let Some(reference) = reference else {
        state.unheard_cycles = state.unheard_cycles.saturating_add(1);
        return;
    };
    if state.unheard_cycles > 0 {
        let leap_rad = state.window.leap_rad(reference, params.period_s);
        let time_s = (state.unheard_cycles + 1) as f64 * params.period_s;
        state.leapt = params.reference_limits.leapt(leap_rad, time_s);
        state.sets_out = true;
        state.unheard_cycles = 0;
    }
}

fn note_surroundings(surroundings: &mut Surroundings, feedback: &Feedback) {
    if feedback.validity & validity::PRESSURE != 0 {
        surroundings.pressure_drop_pa = feedback.pressure_drop_pa;
    }
    if feedback.validity & validity::TEMPERATURE != 0 {
        surroundings.oil_temperature_c = feedback.oil_temperature_c;
    }
}

/// Following error and load angle.
fn measure(params: &Params, state: &mut State, feedback: Option<&Feedback>) {
    if state.machine != ControllerState::Running {
        state.following_error_rad = 0.0;
        state.reading_rad = None;
        return;
    }
    let before_rad = state.reading_rad.take();
    let Some(feedback) = feedback else { return };
    state.following_error_rad = state.window.now().angle_rad - feedback.angle_rad;
    state.following_error_peak_rad = state.following_error_peak_rad.max(state.following_error_rad.abs());
    let age_cycles = params.loop_delay_cycles + params.encoder_delay_cycles;
    let commanded = state.correction.commanded(age_cycles);
    state.behind_aim_rad = commanded.reference_rad - feedback.angle_rad;
    if feedback.validity & validity::ENCODER == 0 {
        return;
    }
    state.reading_rad = Some(feedback.angle_rad);
    state.reading_way_rad = before_rad.map_or(0.0, |before_rad| feedback.angle_rad - before_rad);
    let lag_rad = f64::from(params.motor.rotor_teeth) * (commanded.command_rad - feedback.angle_rad);
    state.load_angle_rad = Some(lag_rad - TAU * state.recovery.teeth as f64);
    state.lost = state.recovery.lost(lag_rad);
}

/// The same ramp that the drive makes by itself when it is no longer asked to follow.
fn ramp_down(params: &Params, state: &mut State) {
    state.travel = drive::ramp_down(&params.drive, state.travel);
    state.position += state.travel;
    rest(params, state);
}

fn stand(params: &Params, state: &mut State, feedback: Option<&Feedback>) {
    if let Some(feedback) = feedback {
        state.position = feedback.accepted_microsteps as f64;
    }
    state.travel = 0.0;
    rest(params, state);
}

fn rest(params: &Params, state: &mut State) {
    state.target = state.position;
    state.wanted = Wanted { reserve_nm: params.motor.holding_torque_nm, ..Wanted::default() };
    state.limits = 0;
    state.time_scale = 1.0;
}

fn command(params: &Params, state: &State) -> StepCommand {
    let moving = matches!(state.machine, ControllerState::Running | ControllerState::QuickStop);
    let holds = params.drive.after_stop != drive::AfterStop::DeEnergise;
    StepCommand {
        // The one place where micro-steps are rounded.
        position_microsteps: state.position.round() as i64,
        position_unrounded: state.position,
        pulse_rate_hz: state.travel / params.period_s,
        torque_feed_forward_nm: state.wanted.torque_nm,
        follow: u64::from(state.machine == ControllerState::Running),
        energise: u64::from(moving || holds),
    }
}

fn status(state: &State) -> ControlStatus {
    ControlStatus {
        state: state.machine.code(),
        fault: state.fault.code(),
        fault_cycle: if state.fault == FaultCode::None { 0 } else { state.fault_cycle },
        following_error_rad: state.following_error_rad,
        following_error_peak_rad: state.following_error_peak_rad,
        friction_estimate_nm: state.wanted.friction_nm,
        disturbance_estimate_nm: state.wanted.beyond_nm,
        wanted_torque_nm: state.wanted.torque_nm,
        lead_angle_rad: state.wanted.lead_rad,
        torque_reserve_nm: state.wanted.reserve_nm,
        limiting: state.limits,
        time_scale: state.time_scale,
        lost_teeth: state.recovery.lost_teeth,
        tooth_offset: state.recovery.teeth,
        operator_id: state.operator_id,
        operator_result: state.operator_result.code(),
        feedback_silent_cycles: state.feedback.silent_cycles(),
        reference_silent_cycles: state.reference.silent_cycles(),
    }
}

//! One cycle of the trajectory.

use signals::{
    ControlStatus, ControllerState, Feedback, HeldFlow, Reference, SetPoint, SetPointRefusal, validity,
};

use crate::accept::{accept, stop, to_angle};
use crate::target::held_flow;
use crate::{Params, State};

/// What a cycle k sees.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// Cycles since the last call, 1 unless cycles were skipped: time moves on by as many periods.
    pub advance_cycles: u64,
    /// Feedback k; `None`: what was measured last still holds.
    pub feedback: Option<&'a Feedback>,
    /// ControlStatus k−1; `None`: what it said before still holds.
    pub status: Option<&'a ControlStatus>,
    /// A set-point that is new in this cycle.
    pub set_point: Option<&'a SetPoint>,
}

/// A held flow is planned anew when its angle has moved by this: a micro-step or two, 0.013 % of a window of 45°.
const REPLAN_ANGLE_RAD: f64 = 1e-4;

/// Called once in cycle k; gives Reference k+2.
///
/// While the controller is not running the reference is the measured angle, at rest, and set-points are refused.
/// While it runs, a set-point takes effect from Reference k+1, which is published already, on: from there its
/// motion continues in angle, speed and acceleration. One that is refused changes nothing but `refused_id` and
/// `refusal`. The reference depends on the inputs alone.
///
/// ```
/// use signals::{ControlStatus, ControllerState, Feedback, SetPoint, SetPointKind, validity};
/// use trajectory::{Input, Limits, Params, State, step};
///
/// let limits = Limits {
///     min_angle_rad: Some(0.0),
///     max_angle_rad: Some(0.8),
///     max_speed_rad_per_s: 10.0,
///     max_acceleration_rad_per_s2: 500.0,
///     max_jerk_rad_per_s3: 1e5,
///     unhomed_speed_rad_per_s: 0.2,
/// };
/// let params = Params { period_s: 1e-3, limits, orifice: None, oil_density_kg_per_m3: None };
/// let mut state = State::at_rest(0.0);
/// let status =
///     ControlStatus { state: ControllerState::Running.code(), time_scale: 1.0, ..ControlStatus::default() };
/// let feedback = Feedback { validity: validity::HOMED, ..Feedback::default() };
/// let target =
///     SetPoint { id: 1, kind: SetPointKind::Angle.code(), value: 0.3, ..SetPoint::default() };
/// let mut cycle = |set_point| {
///     let (feedback, status) = (Some(&feedback), Some(&status));
///     step(&params, &mut state, &Input { advance_cycles: 1, feedback, status, set_point })
/// };
/// cycle(Some(&target));
/// let last = (0..200).map(|_| cycle(None)).last().unwrap();
/// assert_eq!((last.angle_rad, last.moving), (0.3, 0));
/// ```
pub fn step(params: &Params, state: &mut State, input: &Input<'_>) -> Reference {
    note_status(state, input.status);
    note_feedback(state, input.feedback);
    let unhomed;
    let params = if state.seen.homed {
        params
    } else {
        unhomed = Params { limits: params.limits.unhomed(), ..*params };
        &unhomed
    };
    if !state.seen.running {
        let measured_rad = input.feedback.map(|feedback| feedback.angle_rad);
        let angle_rad = measured_rad.unwrap_or_else(|| state.now(params).angle_rad);
        state.rest_at(angle_rad);
        if let Some(set_point) = input.set_point {
            refuse(state, set_point, SetPointRefusal::NotRunning);
        }
        return state.reference(params);
    }
    // What was skipped belongs to the old motion.
    advance(params, state, input.advance_cycles.saturating_sub(1));
    if let Some(set_point) = input.set_point
        && let Err(refusal) = accept(params, state, set_point)
    {
        refuse(state, set_point, refusal);
    }
    follow_up(params, state);
    advance(params, state, 1);
    state.reference(params)
}

fn refuse(state: &mut State, set_point: &SetPoint, refusal: SetPointRefusal) {
    state.refused_id = set_point.id;
    state.refusal = refusal.code();
}

fn note_status(state: &mut State, status: Option<&ControlStatus>) {
    if let Some(status) = status {
        state.seen.running = status.state == ControllerState::Running.code();
        state.seen.time_scale = status.time_scale.clamp(0.0, 1.0);
    }
}

fn note_feedback(state: &mut State, feedback: Option<&Feedback>) {
    if let Some(feedback) = feedback {
        state.seen.homed = feedback.validity & validity::HOMED != 0;
        let measured = feedback.validity & validity::PRESSURE != 0;
        state.seen.pressure_drop_pa = measured.then_some(feedback.pressure_drop_pa);
    }
}

/// What a set-point taken earlier still asks for: the stop that had to wait, the flow that is held. Either is tried
/// again in the next cycle if it can't be had in this one; the present motion stays within the limits meanwhile.
fn follow_up(params: &Params, state: &mut State) {
    if state.stop_wanted
        && let Some(active) = stop(params, state)
    {
        state.stop_wanted = false;
        state.active = active;
    }
    let Some(flow_m3_per_s) = state.held_flow_m3_per_s else {
        state.held_flow = HeldFlow::None;
        return;
    };
    let reached = held_flow(params, flow_m3_per_s, state.seen.pressure_drop_pa, state.held_flow);
    state.held_flow = reached.held;
    let Some(target_rad) = reached.angle_rad else { return };
    let rest_rad = state.active.motion.rest_angle_rad();
    let moved = rest_rad.is_none_or(|rest_rad| (target_rad - rest_rad).abs() > REPLAN_ANGLE_RAD);
    if moved && let Some(active) = to_angle(params, state, target_rad) {
        state.active = active;
    }
}

/// Lets time run along the motion.
fn advance(params: &Params, state: &mut State, periods: u64) {
    if periods == 0 {
        return;
    }
    let time_scale = state.time_scale.towards(state.seen.time_scale, params, &state.active, periods);
    let mean_scale = (state.time_scale.scale + time_scale.scale) / 2.0;
    state.active = state.active.later(periods, params.period_s, mean_scale);
    state.time_scale = time_scale;
}

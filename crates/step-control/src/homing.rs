//! Homing: finds the angle's zero, then how the motor's teeth stand to the encoder.
//!
//! ```text
//!        switch, stop                       index, absolute
//!  Seek ──▶ BackOff ──▶ Approach ──▶ Align ◀──────────── Seek
//!                          │           │
//!                          │ no encoder│ spread small
//!                          ▼           ▼
//!                              SetZero ──▶ Done
//! ```
//! The mark gives the zero. A switch is met twice, the second time slowly, so that its edge and not its delay counts. A
//! hard stop is where the rotor no longer follows at reduced current: the command's lead grows beyond the one of sliding,
//! or the rotor never slides at all. It is met twice, since friction beyond the reduced torque looks alike, but not twice
//! in the same place. An index is latched by the encoder.
//!
//! Then the command goes through one electrical period and back in [`POINTS`] steps, and rests at each: friction makes
//! the rotor lag on the way there and lead on the way back, so the mean of both is how encoder and teeth stand to each
//! other. What varies from point to point (detent, micro-step error, a lost step) is the spread; too large a spread is
//! refused.

use crate::params::Params;
use crate::state::State;
use drive::{Microsteps, MicrostepsPerCycle};
use serde::{Deserialize, Serialize};
use signals::{ControllerState, FaultCode, Feedback, HomingPhase, OperatorResult, validity};
use std::f64::consts::TAU;

/// Rests on the way through an electrical period; the first ten orders of a micro-step error average out over them.
const POINTS: usize = 16;

/// So long the rotor may swing before it is read at a rest, and so long the reading is averaged, s.
const SWING_S: f64 = 0.03;
const READING_S: f64 = 0.01;

/// A switch is approached at this part of the speed of the search.
const CREEP: f64 = 1.0 / 8.0;

/// At the hard stop the command leads the rotor by this more than in sliding, electrical rad.
const STALL_RAD: f64 = 50.0 * std::f64::consts::PI / 180.0;

/// A rotor slides that makes this part of the command's way, looked at every so many s.
const SLIDING: f64 = 0.7;
const SLIDING_S: f64 = 0.02;

/// Tooth pitches by which alignment stays away from the mark: a hard stop must not press on the rotor.
const CLEAR_TEETH: f64 = 1.0;

/// Tooth pitches by which a hard stop is left before it is met again.
const RETREAT_TEETH: f64 = 2.0;

/// Steps of the way before the first and behind the last rest: half an electrical period turns the largest friction lag
/// round.
const TURN_STEPS: usize = POINTS / 2;

/// So long the drive may take to move its zero, s.
const ZERO_S: f64 = 1.0;

/// The part of the holding torque that accelerates the command.
const ACCELERATION_PART: f64 = 1.0 / 16.0;

/// What the valve is homed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum HomingMethod {
    /// A switch that is on beyond its angle.
    Switch,
    /// A hard stop, met at reduced current; needs an encoder.
    Stop,
    /// The encoder's index, once a turn.
    Index,
    /// An absolute encoder whose offset is stored: only the teeth are aligned.
    Absolute,
}

/// How to home.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Homing {
    /// What is looked for.
    pub method: HomingMethod,
    /// Speed of the search, rad/s; its sign is the direction.
    pub speed_rad_per_s: f64,
    /// Angle of the mark, rad.
    pub angle_rad: f64,
    /// How far it is looked for, rad.
    pub longest_rad: f64,
    /// The part of the rated current on the way to a hard stop.
    pub stop_current: f64,
    /// How far the rests of the alignment may lie from their mean, rad.
    pub largest_spread_rad: f64,
}

/// Where homing is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HomingState {
    pub phase: HomingPhase,
    /// Where the command is to go.
    goal: Microsteps,
    /// Where the search began.
    origin: Microsteps,
    /// Angle at which the mark was met, in the frame of the present zero, rad.
    mark_rad: f64,
    /// Rests taken of the alignment, cycles since the command came to rest, and the sum of readings there, rad.
    point: usize,
    rested_cycles: u64,
    sum_rad: f64,
    readings: u64,
    /// Reading minus command at each rest: on the way there, and there and back together.
    lag_rad: [f64; POINTS],
    /// Towards a hard stop: where the phase began, the command's lead in sliding, rad, the furthest angle so far, rad, and
    /// command and reading at the last look, rad, with the cycles since then.
    from: Microsteps,
    sliding_lead_rad: Option<f64>,
    furthest_rad: f64,
    looked_at_rad: (f64, f64),
    looked_cycles: u64,
    /// Encoder's angle minus the one that the teeth hold, rad, and the largest distance of a rest from it, rad.
    pub offset_rad: f64,
    pub spread_rad: f64,
    /// What the drive is asked to shift its zero by.
    pub shift: ZeroShift,
}

/// A new zero for the drive: counts and encoder shift by these.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct ZeroShift {
    /// Counts up with each homing; 0: no shift.
    pub id: u64,
    pub angle_rad: f64,
    pub microsteps: i64,
}

impl HomingState {
    /// None so far.
    pub(crate) fn none() -> Self {
        Self {
            phase: HomingPhase::None,
            goal: Microsteps::default(),
            origin: Microsteps::default(),
            mark_rad: 0.0,
            point: 0,
            rested_cycles: 0,
            sum_rad: 0.0,
            readings: 0,
            lag_rad: [0.0; POINTS],
            from: Microsteps::default(),
            sliding_lead_rad: None,
            furthest_rad: 0.0,
            looked_at_rad: (0.0, 0.0),
            looked_cycles: 0,
            offset_rad: 0.0,
            spread_rad: 0.0,
            shift: ZeroShift::default(),
        }
    }

    /// Begins where the drive holds the motor.
    pub(crate) fn begun(self, params: &Params, homing: &Homing, feedback: &Feedback) -> Self {
        let microstep_rad = params.drive.microstep_angle_rad;
        let position = Microsteps::from(feedback.accepted_microsteps);
        let way = (homing.longest_rad / microstep_rad).copysign(homing.speed_rad_per_s);
        Self {
            phase: HomingPhase::Seek,
            goal: Microsteps(position.0 + way),
            origin: position,
            from: position,
            furthest_rad: feedback.angle_rad,
            looked_at_rad: (position.0 * microstep_rad, feedback.angle_rad),
            // The drive may know a zero of an earlier life of this controller.
            shift: ZeroShift { id: feedback.zero_id, ..ZeroShift::default() },
            ..Self::none()
        }
    }
}

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

/// Looks at the mark, or at where the rotor rests.
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

/// Waits until the drive counts from the new zero.
fn await_zero(params: &Params, state: &mut State, feedback: &Feedback) -> FaultCode {
    state.homing.rested_cycles += 1;
    if feedback.zero_id == state.homing.shift.id {
        state.homing.phase = HomingPhase::Done;
    } else if state.homing.rested_cycles as f64 * params.period_s > ZERO_S {
        return FaultCode::Homing;
    }
    FaultCode::None
}

fn tooth_rad(params: &Params) -> f64 {
    TAU / f64::from(params.motor.rotor_teeth)
}

/// A place `way_rad` further in the direction of the search than the command.
fn beyond(params: &Params, homing: &Homing, state: &State, way_rad: f64) -> Microsteps {
    let way = way_rad / params.drive.microstep_angle_rad * homing.speed_rad_per_s.signum();
    Microsteps(state.steering.position.0 + way)
}

fn arrived(state: &State) -> bool {
    state.steering.position == state.homing.goal && state.steering.travel == MicrostepsPerCycle::ZERO
}

/// Whether the rotor stands against something: it slid and no longer does, or it never slid on a whole tooth pitch.
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
        if towards * way_rad > 0.0 && towards * moved_rad > SLIDING * towards * way_rad {
            *sliding_lead_rad = Some(lead_rad);
        }
        (*looked_at_rad, *looked_cycles) = ((command_rad, feedback.angle_rad), 0);
    }
    match *sliding_lead_rad {
        Some(sliding_rad) => f64::from(params.motor.rotor_teeth) * (lead_rad - sliding_rad) > STALL_RAD,
        None => towards * (command_rad - from.0 * microstep_rad) > tooth_rad(params),
    }
}

/// The mark is found: on to the alignment, or to the new zero where no encoder could be aligned.
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

/// Reads the rotor at the rests of the way there and back.
fn align(params: &Params, homing: &Homing, state: &mut State, feedback: &Feedback) -> FaultCode {
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
/// Points 1 to [`POINTS`] are the rests on the way there, the last [`POINTS`] those on the way back. Points 0 and
/// [`POINTS`] + 1 lie [`TURN_STEPS`] outside: behind them friction lags in the direction of the way.
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

/// Asks the drive for the zero that puts the mark at its angle, and the count where the encoder is.
fn set_zero(params: &Params, homing: &Homing, state: &mut State) {
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

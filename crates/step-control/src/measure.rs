//! Following error and load angle, from the encoder and from what was commanded for the time of its reading.

use crate::params::{Compensation, Params};
use crate::rotor::Seen;
use crate::state::State;
use crate::watch::benefit::Benefit;
use signals::{ControllerState, Feedback, validity};
use std::f64::consts::TAU;

/// Compares this cycle's reading with what the command aimed at for its time.
pub(crate) fn measure(params: &Params, state: &mut State, feedback: Option<&Feedback>) {
    let observation = &mut state.observation;
    if state.supervision.machine != ControllerState::Running {
        observation.following_error_rad = 0.0;
        observation.reading_rad = None;
        observation.seen = None;
        return;
    }
    let before_rad = observation.reading_rad.take();
    let read_rad = feedback
        .filter(|feedback| feedback.validity & validity::ENCODER != 0)
        .map(|feedback| feedback.angle_rad);
    observation.seen = match observation.seen {
        Some(seen) => Some(seen.next(params, &observation.correction, read_rad)),
        None => read_rad.map(Seen::first),
    };
    let Some(feedback) = feedback else { return };
    let error_rad = state.reception.window.now().angle_rad - feedback.angle_rad;
    observation.following_error_rad = error_rad;
    observation.following_error_peak_rad = observation.following_error_peak_rad.max(error_rad.abs());
    let age_cycles = params.loop_delay_cycles + params.encoder_delay_cycles;
    let commanded = observation.correction.commanded(age_cycles);
    observation.behind_aim_rad = commanded.reference_rad - feedback.angle_rad;
    if feedback.validity & validity::ENCODER == 0 {
        return;
    }
    observation.reading_rad = Some(feedback.angle_rad);
    observation.reading_change_rad = before_rad.map_or(0.0, |before_rad| feedback.angle_rad - before_rad);
    if params.observer.is_some() {
        let saturated = observation.correction.saturated();
        observation.alarms.step(params, -observation.behind_aim_rad, saturated);
    }
    note_load(params, state, age_cycles, feedback.angle_rad);
    let observation = &mut state.observation;
    let teeth = f64::from(params.motor.rotor_teeth);
    let lag_rad = teeth * (commanded.command_rad - feedback.angle_rad);
    let load_angle_rad = lag_rad - TAU * observation.recovery.teeth as f64;
    observation.load_angle_rad = Some(load_angle_rad);
    let (with_rad, without_rad) = (observation.behind_aim_rad, load_angle_rad / teeth);
    // If a limit held the command back, it doesn't show the error without compensation either.
    if state.steering.limits == 0 && observation.benefit.harms(params, with_rad, without_rad) {
        observation.alarms.note_harm();
    }
    observation.lost = observation.recovery.lost(lag_rad);
}

/// Takes the load angle of a reading as a measurement of the torque that moves the valve.
fn note_load(params: &Params, state: &mut State, age_cycles: u64, reading_rad: f64) {
    if state.tuning.compensation(params) == Compensation::None {
        return;
    }
    let observation = &mut state.observation;
    let commanded = observation.correction.commanded(age_cycles);
    let expected = commanded.expected;
    let lag_rad = f64::from(params.motor.rotor_teeth) * (commanded.command_rad - reading_rad);
    let torque_nm = params.motor.available_torque_nm(expected.speed_rad_per_s) * lag_rad.sin()
        - params.motor.damping_nm_s_per_rad * expected.speed_rad_per_s;
    let differed = observation.load_share.differs();
    observation.load_share.step(params, &expected, torque_nm);
    if observation.load_share.differs() != differed {
        // The feed-forward changes from now on, so its benefit is judged anew.
        observation.benefit = Benefit::default();
    }
    observation.alarms.note_share(&observation.load_share);
}

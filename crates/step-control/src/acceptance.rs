//! The commands as the drive accepted them: load angle and lost steps are counted from these, not from those sent.
//!
//! Feedback k says where the drive's command stood at t_k. It differs from what was sent for that instant if a command was
//! lost, and the drive went on at the rate of the one before, or if the drive's own limits are tighter than believed.
//! The difference disappears with the next command that arrives, since positions are absolute.

use crate::params::Params;
use crate::state::State;
use drive::Microsteps;
use signals::{ControllerState, Feedback, validity};

/// Compares the drive's position with the one sent for the same instant, and takes over the drive's.
pub(crate) fn note_accepted(params: &Params, state: &mut State, feedback: Option<&Feedback>) {
    let Some(feedback) = feedback.filter(|_| state.supervision.machine == ControllerState::Running) else {
        return;
    };
    let missed = feedback.validity & validity::COMMAND_MISSED != 0;
    let observation = &mut state.observation;
    observation.missed_commands = observation.missed_commands.saturating_add(u64::from(missed));
    observation.alarms.note_command(missed);
    let accepted = Microsteps::from(feedback.accepted_microsteps);
    let accepted_rad = state.steering.angle_rad(params, accepted);
    let age = params.loop_delay_cycles;
    let sent = state.observation.correction.commanded(age);
    let off_rad = accepted_rad - sent.command_rad;
    let explained = params.drive.microstep_angle_rad / 2.0..=farthest_rad(params);
    if !explained.contains(&off_rad.abs()) {
        return;
    }
    let teeth = f64::from(params.motor.rotor_teeth);
    let speed_rad_per_s = state.observation.correction.aim_speed_rad_per_s(age, params.period_s);
    let torque_nm = |command_rad: f64| {
        params.motor.available_torque_nm(speed_rad_per_s) * (teeth * (command_rad - sent.reference_rad)).sin()
    };
    let change_nm = torque_nm(accepted_rad) - torque_nm(sent.command_rad);
    state.observation.correction.accepted(age, accepted_rad, change_nm);
}

/// The largest possible distance between the drive's position and what it was sent: a silence at full speed in one direction,
/// while the commands went in the other. A position further away is none of this drive, and nothing is derived from it.
fn farthest_rad(params: &Params) -> f64 {
    let cycles = params.drive.silence_cycles.saturating_add(params.loop_delay_cycles);
    let way = params.drive.max_pulse_rate_hz * params.period_s * cycles as f64;
    2.0 * way * params.drive.microstep_angle_rad
}

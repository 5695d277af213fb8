//! What is heard of the partners: silence, references that leap, and cycles that this process overran.

use crate::compensation::Surroundings;
use crate::input::Input;
use crate::params::Params;
use crate::state::State;
use crate::track::{coast, re_enter_from_aim};
use signals::{ControllerState, Feedback, Reference, validity};

/// Cycles that this process overran: no command went out, so the drive went on at the last rate. The controller's own
/// state is carried on likewise, or the next command would make up for many cycles in one.
pub(crate) fn pass_over(params: &Params, state: &mut State, cycle: u64) {
    let passed = state.reception.last_cycle.map_or(0, |last| cycle.saturating_sub(last).saturating_sub(1));
    let running = state.supervision.machine == ControllerState::Running;
    let reception = &mut state.reception;
    reception.last_cycle = Some(cycle);
    reception.cycles_without_reference = reception.cycles_without_reference.saturating_add(passed);
    // Beyond the silence limit the drive has stopped by itself, and says so.
    for _ in 0..passed.min(params.drive.silence_cycles) {
        state.reception.window.shift(None, params.period_s);
        if running {
            coast(params, state);
        }
    }
    if running && passed > 0 {
        re_enter_from_aim(params, state);
    }
}

/// Notes this cycle's messages, and those that are missing.
pub(crate) fn listen(params: &Params, state: &mut State, input: &Input) {
    let reception = &mut state.reception;
    reception.feedback.note(input.feedback.is_some());
    reception.reference.note(input.reference.is_some());
    note_gap(params, state, input.reference);
    let reception = &mut state.reception;
    reception.window.shift(input.reference, params.period_s);
    if state.supervision.machine != ControllerState::Running
        && let Some(reference) = input.reference
    {
        // Nothing moved before: the first reference after arming has no history.
        reception.window.fill(reference.kinematics());
    }
    if let Some(feedback) = input.feedback {
        reception.homed = feedback.validity & validity::HOMED != 0;
        state.supervision.zero_in_doubt &= reception.homed;
        note_surroundings(&mut state.observation.surroundings, feedback);
    }
}

/// After missing references, the next one need not continue the one before: it may leap, and starts a re-entry ramp.
fn note_gap(params: &Params, state: &mut State, reference: Option<&Reference>) {
    let reception = &mut state.reception;
    reception.leapt = false;
    let Some(reference) = reference else {
        reception.cycles_without_reference = reception.cycles_without_reference.saturating_add(1);
        return;
    };
    if reception.cycles_without_reference > 0 {
        let leap_rad = reception.window.leap_rad(reference, params.period_s);
        let time_s = (reception.cycles_without_reference + 1) as f64 * params.period_s;
        reception.leapt = params.reference_limits.leapt(leap_rad, time_s);
        state.steering.re_enters = true;
        reception.cycles_without_reference = 0;
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

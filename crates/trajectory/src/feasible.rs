//! Whether a set-point can be followed at all, before a run.

use signals::{SetPoint, SetPointKind, SetPointRefusal};

use crate::accept::accept;
use crate::{Params, State};

/// Whether `set_point` would be accepted from rest at `from_angle_rad`, the valve homed and the controller running.
///
/// A flow at the measured pressure drop (`pressure_given` 0) depends on what will be measured. It is judged at the
/// set-point's `pressure_drop_pa` where that is not zero, so a caller who knows what to expect puts it there; at
/// zero only the orifice is asked for.
///
/// # Errors
/// The reason why it would be refused.
pub fn feasible(params: &Params, from_angle_rad: f64, set_point: &SetPoint) -> Result<(), SetPointRefusal> {
    let mut state = State::at_rest(from_angle_rad);
    state.seen.running = true;
    state.seen.homed = true;
    state.seen.pressure_drop_pa = (set_point.pressure_drop_pa != 0.0).then_some(set_point.pressure_drop_pa);
    match accept(params, &mut state, set_point) {
        Err(SetPointRefusal::NoPressure) if set_point.kind == SetPointKind::Flow.code() => Ok(()),
        other => other,
    }
}

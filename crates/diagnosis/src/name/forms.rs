//! What the forms of accepted causes may leave behind: a model's form is never quite the rig's, and its misfit is no further cause.

use valve_model::EffectId;

/// Causes whose form leaves nothing open: nothing that they leave is a misfit of theirs.
const EXACT: [EffectId; 2] = [EffectId::PressureTorque, EffectId::TorqueOffset];
/// A cause whose form is one of many: no bank of elements is the other's.
pub(crate) const LOOSE: EffectId = EffectId::PreslidingHysteresis;

/// What the forms of the causes that are in may leave, as mean squares in parts of the noise's.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Forms {
    /// What those of an open form explain, as the loss counts it.
    pub open: f64,
    /// What one of a loose form explains of the plain squares.
    pub loose: f64,
}

impl Forms {
    /// Whether a cause's form is open.
    pub fn is_open(id: EffectId) -> bool {
        !EXACT.contains(&id)
    }

    /// One more cause is accepted, which cuts the mean square that the loss counts, and the one of the plain squares, by so much.
    pub fn add(&mut self, id: EffectId, cut: f64, cut_of_squares: f64) {
        if Self::is_open(id) {
            self.open += cut.max(0.0);
        }
        if id == LOOSE {
            self.loose = cut_of_squares.max(0.0);
        }
    }
}

//! How much misfit the functional forms of the accepted causes may leave. A form is never exactly the real one; its misfit is
//! no further cause.

use valve_model::EffectId;

/// Causes whose form is exact (a constant, a line through zero): they leave no misfit.
const EXACT: [EffectId; 4] =
    [EffectId::PressureTorque, EffectId::TorqueOffset, EffectId::LoadInertia, EffectId::TorqueGain];
/// What the misfit of an inexact form may leave, as a share of what the causes of such a form explain.
pub(crate) const MISFIT: f64 = 0.02;
/// The cause whose form fits worst: no bank of Maxwell elements is exactly a real contact.
pub(crate) const HYSTERESIS: EffectId = EffectId::PreslidingHysteresis;

/// Mean squares explained by the accepted causes, relative to the noise variance; their misfit is judged against these.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Forms {
    /// Explained by causes with an inexact form, as the loss counts it.
    pub inexact: f64,
    /// The same by the plain sum of squares.
    pub inexact_of_squares: f64,
    /// Explained by presliding-hysteresis, by the plain sum of squares.
    pub hysteresis: f64,
}

impl Forms {
    /// True if a cause's form is inexact.
    pub fn is_inexact(id: EffectId) -> bool {
        !EXACT.contains(&id)
    }

    /// Counts an accepted cause that cuts the loss's mean square by `cut`, and the plain one by `cut_of_squares`.
    pub fn add(&mut self, id: EffectId, cut: f64, cut_of_squares: f64) {
        if Self::is_inexact(id) {
            self.inexact += cut.max(0.0);
            self.inexact_of_squares += cut_of_squares.max(0.0);
        }
        if id == HYSTERESIS {
            self.hysteresis = cut_of_squares.max(0.0);
        }
    }
}

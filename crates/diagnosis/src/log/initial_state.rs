//! The initial state of a piece's prediction: no channel measures it, so every fit estimates it.

/// The initial state of a piece.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct InitialState {
    /// Torque logs: the torque that friction carries, N·m. Angle logs: the shift of the first angle, rad.
    pub shift: f64,
    /// The side from which the contact came, −1 to 1. It is the earlier deflection of bristles with a memory, as a fraction of
    /// their break-away deflection, and the side of the encoder's play on which the rotor lies. `None`: the bristles come from
    /// where the earlier motion left them, and the rotor lies where that motion or the torques on it put it.
    pub side: Option<f64>,
}

impl InitialState {
    /// With the side that follows from the earlier motion.
    pub fn at(shift: f64) -> Self {
        Self { shift, side: None }
    }

    /// The same side with another shift.
    pub fn shifted(self, shift: f64) -> Self {
        Self { shift, ..self }
    }
}

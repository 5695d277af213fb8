//! How the prediction of a piece begins: what no measurement tells, and every fit estimates.

/// How a piece begins.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct InitialState {
    /// The torque that friction carries, N·m, or the shift of the first angle, rad.
    pub shift: f64,
    /// The side from which the contact came, −1 to 1: the part of their break-away deflection that bristles with a memory
    /// came from, and the side of the encoder's play on which the rotor lies. Without one the bristles come from where the
    /// motion before left them, and the rotor lies where it is drawn to.
    pub side: Option<f64>,
}

impl InitialState {
    /// The likely side.
    pub fn at(shift: f64) -> Self {
        Self { shift, side: None }
    }

    /// The same side.
    pub fn shifted(self, shift: f64) -> Self {
        Self { shift, ..self }
    }
}

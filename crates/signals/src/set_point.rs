//! SetPoint: where the operator or the scenario wants the valve.

message! {
    /// A wish for the trajectory; it is followed, or refused with a reason in [`crate::Reference`].
    SetPoint, "set-point" {
        /// Counts set-points from 1.
        id: u64 ["1", Any],
        /// The last cycle in which it may be taken: a set-point that was given up has no effect later.
        valid_until_cycle: u64 ["1", Any],
        /// What kind, a [`crate::SetPointKind`].
        kind: u64 ["1", Below(crate::SetPointKind::END)],
        /// Angle, opening, flow, speed or a sine's amplitude, in [`crate::SetPointKind::unit`] of its kind.
        value: f64 ["1", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// A sine's frequency; else 0.
        frequency_hz: f64 ["Hz", Within(0.0, 1e6)],
        /// The pressure drop that a flow is meant at, where `pressure_given` is 1.
        pressure_drop_pa: f64 ["Pa", Within(-1e9, 1e9)],
        /// 1: use `pressure_drop_pa`; 0: follow the measured pressure drop.
        pressure_given: u64 ["1", Below(2)],
    }
}

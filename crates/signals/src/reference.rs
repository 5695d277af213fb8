//! Reference n: the motion wanted at t_n.

message! {
    /// Angle, speed, acceleration and jerk wanted at t_n, and which set-point they lead to.
    Reference, "reference" {
        /// Angle wanted.
        angle_rad: f64 ["rad", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// Speed wanted.
        speed_rad_per_s: f64 ["rad/s", Within(-1e6, 1e6)],
        /// Acceleration wanted.
        acceleration_rad_per_s2: f64 ["rad/s^2", Within(-1e9, 1e9)],
        /// Jerk wanted until the next reference.
        jerk_rad_per_s3: f64 ["rad/s^3", Within(-1e12, 1e12)],
        /// Where the motion ends; the present angle where it has no end.
        target_angle_rad: f64 ["rad", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// The set-point that is followed, by its id; 0 before the first.
        set_point_id: u64 ["1", Any],
        /// What kind it is, a [`crate::SetPointKind`].
        set_point_kind: u64 ["1", Below(crate::SetPointKind::END)],
        /// 1 while the reference moves, 0 when it has arrived.
        moving: u64 ["1", Below(2)],
        /// How fast the motion's time runs: 1, or less while the controller is short of torque.
        time_scale: f64 ["1", Within(0.0, 1.0)],
        /// The set-point refused last, by its id; 0 while none was.
        refused_id: u64 ["1", Any],
        /// Why it was refused, a [`crate::SetPointRefusal`].
        refusal: u64 ["1", Below(crate::SetPointRefusal::END)],
        /// Whether a flow that is to be held is, a [`crate::HeldFlow`].
        held_flow: u64 ["1", Below(crate::HeldFlow::END)],
    }
}

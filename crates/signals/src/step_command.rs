//! StepCommand n: where the micro-step command shall be at t_n+1.

message! {
    /// The command for cycle n, in the manner of cyclic synchronous position: within the cycle the drive goes to
    /// the position at constant pulse rate. A bus bridge wraps the count to what its bus carries and may use rate
    /// and torque as feed-forward.
    StepCommand, "step-command" {
        /// Where the command shall be at t_n+1, in absolute micro-steps: `position_unrounded`, rounded.
        position_microsteps: i64 ["1", Within(-MAX_MICROSTEPS, MAX_MICROSTEPS)],
        /// The same before rounding, in micro-steps; limits hold on it.
        position_unrounded: f64 ["1", Within(-MAX_MICROSTEPS, MAX_MICROSTEPS)],
        /// Pulse rate of the cycle, signed: change of `position_unrounded` over the period.
        pulse_rate_hz: f64 ["Hz", Within(-1e9, 1e9)],
        /// Torque that the controller expects to need at t_n+1, for drives that take a torque offset.
        torque_feed_forward_nm: f64 ["N*m", Within(-1e6, 1e6)],
        /// 1 while the drive shall follow; 0 asks it to ramp to a stop by itself.
        follow: u64 ["1", Below(2)],
        /// Under which arming the drive shall follow, counted from 1; 0 exactly where `follow` is. A drive begins to follow under a new one
        /// alone, once, and takes a command whose two fields contradict each other for none.
        follow_id: u64 ["1", Any],
        /// 1 while the windings shall carry current.
        energise: u64 ["1", Below(2)],
        /// The part of the rated current that they shall carry: less on the way to a hard stop.
        current_ratio: f64 ["1", Within(0.0, 1.0)],
        /// The newest zero, counted; 0 before the first. With a new one the drive shifts its zero, once, at standstill and
        /// while it does not follow, and says that it is homed.
        zero_id: u64 ["1", Any],
        /// What the new zero adds to the encoder's angle.
        zero_shift_rad: f64 ["rad", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// What it adds to the count of micro-steps; the current's phase stays.
        zero_shift_microsteps: i64 ["1", Within(-MAX_MICROSTEPS, MAX_MICROSTEPS)],
        /// 1 from the loss of steps until the drive says that it is not homed: its zero is not to be trusted before the next one.
        zero_in_doubt: u64 ["1", Below(2)],
    }
}

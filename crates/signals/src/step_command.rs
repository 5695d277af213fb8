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
        /// 1 while the windings shall carry current.
        energise: u64 ["1", Below(2)],
    }
}

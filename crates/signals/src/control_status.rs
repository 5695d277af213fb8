//! ControlStatus k: what the controller found and decided in cycle k.

/// The bits of [`ControlStatus::limiting`]: a limit that holds the command back, which is not a fault.
pub mod limiting {
    /// The pulse rate is at the driver's limit.
    pub const PULSE_RATE: u64 = 1 << 0;
    /// The pulse rate's change is at the driver's limit.
    pub const PULSE_ACCELERATION: u64 = 1 << 1;
    /// The wanted torque is more than the motor has to give at this speed.
    pub const TORQUE: u64 = 1 << 2;
    /// The observer's estimate of the disturbance is at its limit.
    pub const OBSERVER: u64 = 1 << 3;
    /// The first bit that is not used.
    pub const END: u64 = 1 << 4;
    /// Each bit with its name.
    pub const NAMES: [(u64, &str); 4] = [
        (PULSE_RATE, "pulse rate"),
        (PULSE_ACCELERATION, "pulse acceleration"),
        (TORQUE, "torque"),
        (OBSERVER, "observer"),
    ];
}

/// The bits of [`ControlStatus::alarms`]: what the operator has to know, and what stops nothing. Kept until the next arming.
pub mod alarm {
    /// The loop oscillated; the observer trusts the belief less since, and is slower.
    pub const OSCILLATION: u64 = 1 << 0;
    /// The observer has been at its limit for long: the belief is far from the valve.
    pub const OBSERVER_SATURATED: u64 = 1 << 1;
    /// More than a third of the commands to the drive were lost; the observer is off since, as it counts on them.
    pub const COMMANDS_LOST: u64 = 1 << 2;
    /// The valve takes clearly less torque than the belief expects; the feed-forward is reduced to the share it takes.
    pub const LOAD_BELOW_BELIEF: u64 = 1 << 3;
    /// The valve's inertia is clearly not the believed one; the observer trusts the belief less since, and is slower.
    pub const INERTIA: u64 = 1 << 4;
    /// The loop oscillated with the slower observer too; it is off, and only the feed-forward is left.
    pub const OBSERVER_OFF: u64 = 1 << 5;
    /// The lead of the command makes the error larger than the load angle would; nothing is compensated any more.
    pub const NO_BENEFIT: u64 = 1 << 6;
    /// The valve takes clearly more torque than the belief expects, or its encoder has play.
    pub const LOAD_ABOVE_BELIEF: u64 = 1 << 7;
    /// The first bit that is not used.
    pub const END: u64 = 1 << 8;
    /// Each bit with its name.
    pub const NAMES: [(u64, &str); 8] = [
        (OSCILLATION, "the loop oscillated, observer slowed"),
        (OBSERVER_SATURATED, "observer at its limit"),
        (COMMANDS_LOST, "commands to the drive were lost, observer off"),
        (LOAD_BELOW_BELIEF, "less friction than believed, feed-forward reduced"),
        (INERTIA, "inertia other than believed, observer slowed"),
        (OBSERVER_OFF, "the loop oscillated again, observer off"),
        (NO_BENEFIT, "compensation makes the error larger, compensation off"),
        (LOAD_ABOVE_BELIEF, "more friction than believed, or an encoder with play"),
    ];

    /// The names of the bits that are set.
    pub fn names(alarms: u64) -> impl Iterator<Item = &'static str> {
        NAMES.into_iter().filter(move |(bit, _)| alarms & bit != 0).map(|(_, name)| name)
    }
}

message! {
    /// State, fault, following error, and the quantities behind the StepCommand of the same cycle.
    ControlStatus, "control-status" {
        /// A [`crate::ControllerState`].
        state: u64 ["1", Below(crate::ControllerState::END)],
        /// Why the valve was stopped, a [`crate::FaultCode`]; kept until reset.
        fault: u64 ["1", Below(crate::FaultCode::END)],
        /// The cycle in which the fault was found.
        fault_cycle: u64 ["1", Any],
        /// Reference k − angle k, while running; else 0.
        following_error_rad: f64 ["rad", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// Its largest magnitude since arming or reset.
        following_error_peak_rad: f64 ["rad", Within(0.0, MAX_ANGLE_RAD)],
        /// Friction torque that the controller compensates.
        friction_estimate_nm: f64 ["N*m", Within(-1e6, 1e6)],
        /// What the observer adds to the friction that is fed forward; contained in `friction_estimate_nm`.
        disturbance_estimate_nm: f64 ["N*m", Within(-1e6, 1e6)],
        /// Torque wanted from the motor: inertia, damping and friction.
        wanted_torque_nm: f64 ["N*m", Within(-1e6, 1e6)],
        /// Electrical lead of command before rotor that gives it.
        lead_angle_rad: f64 ["rad", Within(-7.0, 7.0)],
        /// What the motor could give beyond the wanted torque; negative when it can't.
        torque_reserve_nm: f64 ["N*m", Within(-1e6, 1e6)],
        /// Limits that hold the command back: bits of [`limiting`].
        limiting: u64 ["1", Below(limiting::END)],
        /// What the operator has to know: bits of [`alarm`].
        alarms: u64 ["1", Below(alarm::END)],
        /// Electrical lead of the command that the drive accepted over the rotor at the newest reading, lost teeth aside; 0
        /// without an encoder.
        load_angle_rad: f64 ["rad", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// Commands since arming that the drive did not have in time.
        missed_commands: u64 ["1", Any],
        /// How fast the trajectory's time shall run.
        time_scale: f64 ["1", Within(0.0, 1.0)],
        /// Tooth pitches lost since arming, each of them noticed, in whatever direction.
        lost_teeth: u64 ["1", Any],
        /// Tooth pitches by which the command is beyond the angle that it holds, as far as the controller knows.
        tooth_offset: i64 ["1", Within(-MAX_MICROSTEPS, MAX_MICROSTEPS)],
        /// The operator command answered last, by its id; 0 before the first.
        operator_id: u64 ["1", Any],
        /// What became of it, a [`crate::OperatorResult`].
        operator_result: u64 ["1", Below(crate::OperatorResult::END)],
        /// Where homing is, or how far the last one came, a [`crate::HomingPhase`].
        homing_phase: u64 ["1", Below(crate::HomingPhase::END)],
        /// Angle of the encoder beyond the one that the motor's teeth held, as the last homing found it, before its shift.
        alignment_offset_rad: f64 ["rad", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// How far single rests of the alignment lay from their mean, at most.
        alignment_spread_rad: f64 ["rad", Within(0.0, MAX_ANGLE_RAD)],
        /// Cycles in a row without a valid Feedback.
        feedback_silent_cycles: u64 ["1", Any],
        /// Cycles in a row without a valid Reference.
        reference_silent_cycles: u64 ["1", Any],
    }
}

//! Feedback k: what the drive and the sensors say about t_k.

/// The bits of [`Feedback::validity`].
pub mod validity {
    /// An encoder is fitted; `encoder_counts` and `angle_rad` come from it.
    pub const ENCODER: u64 = 1 << 0;
    /// The angle's zero is known.
    pub const HOMED: u64 = 1 << 1;
    /// `pressure_drop_pa` is measured and valid.
    pub const PRESSURE: u64 = 1 << 2;
    /// `oil_temperature_c` is measured and valid.
    pub const TEMPERATURE: u64 = 1 << 3;
    /// The motor's windings carry current.
    pub const ENERGISED: u64 = 1 << 4;
    /// The drive stands still: its pulse rate is zero.
    pub const STANDSTILL: u64 = 1 << 5;
    /// The drive had to cut the last command to its limits.
    pub const LIMITED: u64 = 1 << 6;
    /// The drive is stopping, or has stopped, by itself.
    pub const STOPPED_ITSELF: u64 = 1 << 7;
    /// No fresh StepCommand was there for the cycle that ends at t_k.
    pub const COMMAND_MISSED: u64 = 1 << 8;
    /// The home switch is on.
    pub const HOME_SWITCH: u64 = 1 << 9;
    /// The encoder passed its index in the cycle that ends at t_k; `index_angle_rad` is where.
    pub const INDEX: u64 = 1 << 10;
    /// The first bit that is not used.
    pub const END: u64 = 1 << 11;
}

message! {
    /// The valve's state at the beginning of a cycle, as the drive and its sensors report it.
    ///
    /// A bus bridge fills it from the inputs of its frame: position actual value (micro-steps and encoder),
    /// status word, digital inputs, and the difference between the bus's clock and ours.
    Feedback, "feedback" {
        /// Encoder position in counts, not wrapped; 0 without an encoder.
        encoder_counts: i64 ["1", Within(-MAX_MICROSTEPS, MAX_MICROSTEPS)],
        /// Measured valve angle: the encoder's, else the accepted command's.
        angle_rad: f64 ["rad", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// Where the drive's command stands at t_k, in absolute micro-steps.
        accepted_microsteps: i64 ["1", Within(-MAX_MICROSTEPS, MAX_MICROSTEPS)],
        /// Pulse rate of the cycle that ends at t_k, signed.
        pulse_rate_hz: f64 ["Hz", Within(-1e9, 1e9)],
        /// Pressure drop over the orifice; 0 where not measured.
        pressure_drop_pa: f64 ["Pa", Within(-1e9, 1e9)],
        /// Oil temperature; 0 where not measured.
        oil_temperature_c: f64 ["degC", Within(-273.15, 1000.0)],
        /// Which of these are valid, and what the drive is doing: bits of [`validity`].
        validity: u64 ["1", Below(validity::END)],
        /// Why the drive stopped by itself, a [`crate::FaultCode`].
        drive_fault: u64 ["1", Below(crate::FaultCode::END)],
        /// The drive's own status word as its bus carries it; 0 from the simulator.
        status_word: u64 ["1", Any],
        /// Digital inputs as the bus carries them; 0 from the simulator.
        digital_inputs: u64 ["1", Any],
        /// The cycle of the newest StepCommand accepted.
        command_cycle: u64 ["1", Any],
        /// The newest zero that the drive took from a StepCommand; 0 before the first.
        zero_id: u64 ["1", Any],
        /// Angle that the encoder latched at its index; 0 unless INDEX is set.
        index_angle_rad: f64 ["rad", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// What to add to our clock to meet the bus's; 0 from the simulator.
        phase_correction_ns: i64 ["ns", Within(-1e9, 1e9)],
    }
}

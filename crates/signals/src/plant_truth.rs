//! PlantTruth k: what only the simulator knows; for the recorder alone.

message! {
    /// The simulated valve at t_k. Never read by the controller or the trajectory.
    PlantTruth, "plant-truth" {
        /// True rotor and spool angle.
        angle_rad: f64 ["rad", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// True speed.
        speed_rad_per_s: f64 ["rad/s", Within(-1e6, 1e6)],
        /// Angle at which a free rotor would rest: that of the current's phase, whatever zero the count has.
        command_angle_rad: f64 ["rad", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// What the encoder's zero adds to the true angle.
        encoder_zero_rad: f64 ["rad", Within(-MAX_ANGLE_RAD, MAX_ANGLE_RAD)],
        /// Torque of the motor on the shaft, its damping included.
        motor_torque_nm: f64 ["N*m", Within(-1e6, 1e6)],
        /// Friction torque on the spool.
        friction_torque_nm: f64 ["N*m", Within(-1e6, 1e6)],
        /// Every other torque that loads the spool.
        other_torque_nm: f64 ["N*m", Within(-1e6, 1e6)],
        /// What a transducer between motor and load reads.
        load_torque_nm: f64 ["N*m", Within(-1e6, 1e6)],
        /// Bristle deflection, where the law has one.
        bristle_deflection_rad: f64 ["rad", Within(-1e6, 1e6)],
        /// Flow through the orifice.
        flow_m3_per_s: f64 ["m^3/s", Within(-1e3, 1e3)],
        /// Tooth pitches by which the rotor has fallen behind or ahead since the start.
        lost_teeth: i64 ["1", Within(-MAX_MICROSTEPS, MAX_MICROSTEPS)],
        /// Pulses that the driver gave in the cycle that ends at t_k, signed: counted where they reach the motor.
        pulses: i64 ["1", Within(-MAX_MICROSTEPS, MAX_MICROSTEPS)],
        /// Time of the first of them after that cycle's beginning; 0 where there was none.
        first_pulse_ns: u64 ["ns", Any],
        /// The same of the last.
        last_pulse_ns: u64 ["ns", Any],
    }
}

//! Set-points: what the valve shall do from a time on.

/// A set-point and when it comes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScheduledSetPoint {
    /// Time in seconds after arming.
    pub time_s: f64,
    /// What the valve shall do.
    pub set_point: SetPoint,
    /// Line in the scenario's file, from 1, for messages.
    pub line: usize,
}

/// What the valve shall do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SetPoint {
    /// Go to an angle and stay.
    Angle {
        /// The angle, in radians.
        angle_rad: f64,
    },
    /// Go to an opening and stay.
    Opening {
        /// 0 closed, 1 open.
        opening: f64,
    },
    /// Hold a flow.
    Flow {
        /// The flow, in m³/s.
        flow_m3_per_s: f64,
        /// The pressure drop that the opening is computed for.
        pressure_drop: FlowPressure,
    },
    /// Turn without end.
    Speed {
        /// The speed, in rad/s; its sign is the direction.
        speed_rad_per_s: f64,
    },
    /// Turn without end, at a rate of micro-steps.
    PulseRate {
        /// Micro-steps per second; its sign is the direction.
        pulse_rate_hz: f64,
    },
    /// Oscillate about the present angle.
    Sine {
        /// Amplitude, in radians.
        amplitude_rad: f64,
        /// Frequency, in hertz.
        frequency_hz: f64,
    },
    /// Come to rest and stay.
    Hold,
}

/// The pressure drop that a flow set-point is computed for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FlowPressure {
    /// What Feedback says at present.
    Measured,
    /// A given pressure drop, in pascals.
    Given(f64),
}

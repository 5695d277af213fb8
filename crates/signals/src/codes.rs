//! The codes that messages carry as `u64`: sources, states, faults, kinds.

/// Declares an enumeration with its codes on the wire and its names for people.
macro_rules! codes {
    ($(#[$doc:meta])* $name:ident { $( $(#[$variant_doc:meta])* $variant:ident = $code:literal, $text:literal; )* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        pub enum $name { $( $(#[$variant_doc])* $variant ),* }

        impl $name {
            /// All of them, in the order of their codes.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];
            /// The first code that is not used: messages refuse it and all above.
            pub const END: u64 = { let mut end = 0; $( if $code >= end { end = $code + 1; } )* end };

            /// The code as messages carry it.
            pub const fn code(self) -> u64 {
                match self { $(Self::$variant => $code),* }
            }

            /// The meaning of a code; `None` for one that is not used.
            pub const fn from_code(code: u64) -> Option<Self> {
                match code { $($code => Some(Self::$variant),)* _ => None }
            }

            /// The name for people, logs and files.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text),* }
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}

codes! {
    /// The processes that publish. Simulator and bus bridge share one source: the controller can't tell them apart.
    Source {
        /// Makes References.
        Trajectory = 1, "trajectory-generator";
        /// Makes StepCommands.
        Controller = 2, "step-controller";
        /// The valve: simulator or bus bridge.
        Plant = 3, "plant-simulator";
        /// Records.
        Recorder = 4, "run-recorder";
        /// Speaks for the operator.
        Supervisor = 5, "supervisor";
    }
}

codes! {
    /// The controller's states.
    ///
    /// ```text
    ///             arm, home             drive holds
    ///  Disarmed ───────────▶ Arming ─────────────────▶ Running │ Homing
    ///     ▲                     │                         │       │ found, aligned
    ///     │                     │ disarm, fault           │       │
    ///     │◀── stopped, no fault ── QuickStop ◀───────────┴───────┘
    ///     │                            │ stopped by a fault
    ///     └──────── reset ────────── Fault
    /// ```
    ControllerState {
        /// Commands nothing; the windings carry no current unless the valve is set to be held.
        Disarmed = 0, "disarmed";
        /// Follows the reference.
        Running = 1, "running";
        /// Ramps the pulse rate to zero.
        QuickStop = 2, "quick-stop";
        /// Stopped by a fault; only a reset leaves it.
        Fault = 3, "fault";
        /// Current is on and nothing is followed until the drive says that it holds.
        Arming = 4, "arming";
        /// Looks for the angle's zero.
        Homing = 5, "homing";
    }
}

codes! {
    /// Where homing is.
    HomingPhase {
        /// Not homing, and not homed by this controller.
        None = 0, "none";
        /// Looks for the mark.
        Seek = 1, "seek";
        /// Leaves the mark to meet it once more.
        BackOff = 2, "back off";
        /// Meets the mark slowly.
        Approach = 3, "approach";
        /// Measures how the motor's teeth stand to the encoder.
        Align = 4, "align";
        /// Waits for the drive to count from the new zero.
        SetZero = 5, "set zero";
        /// Found and aligned.
        Done = 6, "done";
    }
}

codes! {
    /// Why the controller, or the plant side's guard, stopped the valve.
    FaultCode {
        /// Nothing is wrong.
        None = 0, "none";
        /// No valid Feedback for `silence_cycles`.
        FeedbackSilent = 1, "feedback silent";
        /// No valid Reference for `silence_cycles`.
        ReferenceSilent = 2, "reference silent";
        /// No valid StepCommand for `silence_cycles` (found by the plant side).
        CommandSilent = 3, "step command silent";
        /// The following error exceeded its limit.
        FollowingError = 4, "following error";
        /// The drive reports a fault of its own.
        Drive = 5, "drive";
        /// The rotor fell into another tooth.
        LostSteps = 6, "lost steps";
        /// The reference left the limits of motion.
        ReferenceLimit = 7, "reference beyond limits";
        /// The accepted position is not the one commanded.
        CommandMismatch = 8, "command not accepted";
        /// No good reply on the drive's bus for `silence_cycles`.
        BusLost = 9, "bus lost";
        /// The drive left operation by itself, or did not come to it.
        DriveLeftOperation = 10, "drive left operation";
        /// The cycle is not on the bus's clock.
        NotSynchronised = 11, "not synchronised to the bus";
        /// The drive did not energise the motor, or did not come to rest on it, in time.
        NotEnergised = 12, "drive not energised";
        /// Homing found no mark, or no alignment within its spread.
        Homing = 13, "homing failed";
        /// The valve left the limits of angle (found by the plant side).
        AngleLimit = 14, "angle beyond limits";
        /// A quick stop is over, but the drive, or the encoder, does not come to rest.
        NeverRests = 15, "valve does not come to rest";
    }
}

codes! {
    /// What the bridge to a real drive is doing with the bus.
    BusPhase {
        /// Waits for the next attempt to bring it up, or asks who is there.
        Wait = 0, "waiting";
        /// From INIT to SAFE-OP.
        BringUp = 1, "bring-up";
        /// Our cycle comes onto the bus's clock.
        Lock = 2, "locking";
        /// OP is asked for.
        Start = 3, "starting";
        /// In operation.
        Operate = 4, "in operation";
    }
}

codes! {
    /// What kind of set-point.
    SetPointKind {
        /// Stand still where the motion can stop soonest.
        Hold = 0, "hold";
        /// Valve angle in rad.
        Angle = 1, "angle";
        /// Opening from 0 (closed) to 1 (open).
        Opening = 2, "opening";
        /// Flow in m³/s at a given or the measured pressure drop.
        Flow = 3, "flow";
        /// Constant speed in rad/s, without an end.
        Speed = 4, "speed";
        /// A sine about the present angle.
        Sine = 5, "sine";
    }
}

impl SetPointKind {
    /// The unit of [`crate::SetPoint::value`] for this kind, as run files write units; "1" where it has no value.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Hold | Self::Opening => "1",
            Self::Angle | Self::Sine => "rad",
            Self::Flow => "m^3/s",
            Self::Speed => "rad/s",
        }
    }
}

codes! {
    /// Why a set-point was refused.
    SetPointRefusal {
        /// It was not.
        None = 0, "none";
        /// The angle lies outside the limits of motion.
        AngleLimit = 1, "angle outside the limits";
        /// The speed lies outside the limits of motion.
        SpeedLimit = 2, "speed outside the limits";
        /// The acceleration lies outside the limits of motion.
        AccelerationLimit = 3, "acceleration outside the limits";
        /// The orifice can't pass this flow at this pressure drop.
        Flow = 4, "flow out of reach";
        /// The valve has no known zero: absolute set-points mean nothing.
        NotHomed = 5, "not homed";
        /// The controller is not running.
        NotRunning = 6, "not running";
        /// No valid pressure drop to turn a flow into an angle.
        NoPressure = 7, "no valid pressure drop";
        /// The motion could not be planned within the limits.
        NoPlan = 8, "no motion within the limits";
        /// The model has no orifice.
        NoOrifice = 9, "the model has no orifice";
    }
}

codes! {
    /// What becomes of a flow that is held while the pressure drop changes.
    HeldFlow {
        /// None is to be held.
        None = 0, "none";
        /// It is held.
        Held = 1, "held";
        /// No angle within the limits of motion gives it; the valve stands as near as they let it come.
        OutOfReach = 2, "out of reach";
        /// The pressure drop is not measured; the valve stays where it is.
        NoPressure = 3, "no valid pressure drop";
    }
}

codes! {
    /// What the operator wants.
    OperatorKind {
        /// Nothing: the service's first, empty message.
        Nothing = 0, "nothing";
        /// Begin to follow the reference.
        Arm = 1, "arm";
        /// Stop and hold.
        Disarm = 2, "disarm";
        /// Leave a fault.
        Reset = 3, "reset";
        /// Give a parameter another value, in any state; it holds until the controller ends.
        SetParameter = 4, "set parameter";
        /// Find the angle's zero.
        Home = 5, "home";
    }
}

codes! {
    /// Parameters of the controller that can be changed while it runs.
    ControlParameter {
        /// No parameter.
        None = 0, "none";
        /// How much friction is fed forward: 0 none, 1 Coulomb and viscous, 2 full law, 3 full law with effects.
        CompensationLevel = 1, "compensation level";
        /// The observer's bandwidth, Hz.
        ObserverBandwidth = 2, "observer bandwidth";
        /// The largest torque that the observer makes up for, N·m.
        ObserverLimit = 3, "observer limit";
        /// Following error at rest that is a fault, rad.
        MaxFollowingError = 4, "largest following error";
        /// By how much that grows with speed, s.
        FollowingErrorPerSpeed = 5, "following error per speed";
    }
}

codes! {
    /// What became of the last operator command.
    OperatorResult {
        /// None was given.
        None = 0, "none";
        /// Done.
        Done = 1, "done";
        /// The state did not allow it.
        WrongState = 2, "not possible in this state";
        /// The valve is not ready (no valid Feedback or Reference).
        NotReady = 3, "not ready";
        /// The parameter can't have this value, or this controller has no such parameter.
        Refused = 4, "value refused";
        /// The order's last cycle was over when it was read.
        Expired = 5, "came too late";
        /// Begun: what becomes of it is told under the same id.
        Begun = 6, "begun";
        /// The fault that ended it is in the status.
        Failed = 7, "failed";
        /// The scenario says no way to find the zero.
        NoHoming = 8, "no way of homing is set";
    }
}

codes! {
    /// The scheduling that a process really obtained.
    Scheduling {
        /// The normal scheduler.
        Other = 0, "normal";
        /// SCHED_FIFO.
        Fifo = 1, "fifo";
    }
}

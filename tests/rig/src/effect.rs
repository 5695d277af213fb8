//! The effects that can be hidden: an enum for the rig, names for whoever asks and judges.

use crate::log_kind::LogKind;

macro_rules! effects {
    ($($variant:ident = $name:literal, $listed:expr, $needs:expr;)*) => {
        /// An effect that can be hidden. Matches over it name every effect, so that one that is added is forgotten nowhere.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(crate) enum Effect {
            $($variant,)*
        }

        impl Effect {
            /// In the order that [`crate::effects_of`], [`crate::OUTSIDE`] and [`crate::LAWS`] list them.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }

            pub fn listed(self) -> Listed {
                match self {
                    $(Self::$variant => $listed,)*
                }
            }

            pub fn needs(self) -> Needs {
                match self {
                    $(Self::$variant => $needs,)*
                }
            }
        }
    };
}

// Name, which list of causes has it, and the channel that it needs.
effects! {
    CoulombLevel = "coulomb-level", Listed::Both, Needs::Nothing;
    StaticLevel = "static-level", Listed::Both, Needs::Nothing;
    ViscousLevel = "viscous-level", Listed::Both, Needs::Nothing;
    StribeckVelocity = "stribeck-velocity", Listed::Both, Needs::Nothing;
    BristleStiffness = "bristle-stiffness", Listed::Both, Needs::Nothing;
    LoadInertia = "load-inertia", Listed::Both, Needs::Nothing;
    PressureDependentFriction = "pressure-dependent-friction", Listed::Both, Needs::Pressure;
    TemperatureDependentViscosity = "temperature-dependent-viscosity", Listed::Both, Needs::Temperature;
    TemperatureDependentFriction = "temperature-dependent-friction", Listed::Both, Needs::Temperature;
    AngleDependentFriction = "angle-dependent-friction", Listed::Both, Needs::Nothing;
    DirectionAsymmetry = "direction-asymmetry", Listed::Both, Needs::Nothing;
    DwellStiction = "dwell-stiction", Listed::Both, Needs::Nothing;
    HydraulicLock = "hydraulic-lock", Listed::Both, Needs::Pressure;
    FrictionLag = "friction-lag", Listed::Both, Needs::Nothing;
    PreslidingHysteresis = "presliding-hysteresis", Listed::Both, Needs::Nothing;
    WearDrift = "wear-drift", Listed::Both, Needs::Nothing;
    FlowTorque = "flow-torque", Listed::Both, Needs::Pressure;
    PressureTorque = "pressure-torque", Listed::Both, Needs::Pressure;
    PositionTorque = "position-torque", Listed::Both, Needs::Nothing;
    CouplingCompliance = "coupling-compliance", Listed::Both, Needs::Nothing;
    SensorDelay = "sensor-delay", Listed::Both, Needs::Nothing;
    TorqueOffset = "torque-offset", Listed::Only(LogKind::Torque), Needs::Nothing;
    TorqueGain = "torque-gain", Listed::Only(LogKind::Torque), Needs::Nothing;
    HoldingTorqueLevel = "holding-torque-level", Listed::Only(LogKind::Angle), Needs::Nothing;
    DetentTorque = "detent-torque", Listed::Only(LogKind::Angle), Needs::Nothing;
    MicrostepError = "microstep-error", Listed::Only(LogKind::Angle), Needs::Nothing;
    Backlash = "backlash", Listed::Only(LogKind::Angle), Needs::Nothing;
    MissedSteps = "missed-steps", Listed::Only(LogKind::Angle), Needs::Nothing;
    EncoderEccentricity = "encoder-eccentricity", Listed::Only(LogKind::Angle), Needs::Nothing;
    OutsideSquareDrag = "outside-square-drag", Listed::Nowhere, Needs::Nothing;
    OutsideHum = "outside-hum", Listed::Nowhere, Needs::Nothing;
    OutsideGear = "outside-gear", Listed::Nowhere, Needs::Nothing;
    OutsideWander = "outside-wander", Listed::Nowhere, Needs::Nothing;
    OutsidePlay = "outside-play", Listed::Nowhere, Needs::Nothing;
    OutsideLaw = "outside-law", Listed::Nowhere, Needs::Nothing;
    OutsidePressureLaw = "outside-pressure-law", Listed::Nowhere, Needs::Pressure;
    OutsideWarmthLaw = "outside-warmth-law", Listed::Nowhere, Needs::Temperature;
    OutsideWarmPressureLaw = "outside-warm-pressure-law", Listed::Nowhere, Needs::Both;
}

/// Which list of causes has an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Listed {
    /// For logs of both kinds.
    Both,
    /// For logs of one kind.
    Only(LogKind),
    /// None has it.
    Nowhere,
}

/// The channel that an effect needs to be more than a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Needs {
    Pressure,
    Temperature,
    Both,
    Nothing,
}

impl Needs {
    pub fn pressure(self) -> bool {
        matches!(self, Self::Pressure | Self::Both)
    }

    pub fn temperature(self) -> bool {
        matches!(self, Self::Temperature | Self::Both)
    }
}

impl Effect {
    /// An effect by its name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|effect| effect.name() == name)
    }

    /// Whether a list of causes has it for logs of this kind.
    pub fn is_listed_for(self, log: LogKind) -> bool {
        match self.listed() {
            Listed::Both => true,
            Listed::Only(kind) => kind == log,
            Listed::Nowhere => false,
        }
    }
}

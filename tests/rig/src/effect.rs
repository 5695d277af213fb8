//! The effects that can be hidden: an enum for the rig, names for whoever asks and judges.

use crate::hidden::LogKind;

macro_rules! effects {
    ($($variant:ident = $name:literal,)*) => {
        /// An effect that can be hidden. Matches over it name every effect, so that one that is added is forgotten nowhere.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(crate) enum Effect {
            $($variant,)*
        }

        impl Effect {
            /// In the order that [`crate::effects_of`] and [`crate::OUTSIDE`] list them.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)*
                }
            }
        }
    };
}

effects! {
    CoulombLevel = "coulomb-level",
    StaticLevel = "static-level",
    ViscousLevel = "viscous-level",
    StribeckVelocity = "stribeck-velocity",
    BristleStiffness = "bristle-stiffness",
    LoadInertia = "load-inertia",
    PressureDependentFriction = "pressure-dependent-friction",
    TemperatureDependentViscosity = "temperature-dependent-viscosity",
    TemperatureDependentFriction = "temperature-dependent-friction",
    AngleDependentFriction = "angle-dependent-friction",
    DirectionAsymmetry = "direction-asymmetry",
    DwellStiction = "dwell-stiction",
    HydraulicLock = "hydraulic-lock",
    FrictionLag = "friction-lag",
    PreslidingHysteresis = "presliding-hysteresis",
    WearDrift = "wear-drift",
    FlowTorque = "flow-torque",
    PressureTorque = "pressure-torque",
    PositionTorque = "position-torque",
    CouplingCompliance = "coupling-compliance",
    SensorDelay = "sensor-delay",
    TorqueOffset = "torque-offset",
    TorqueGain = "torque-gain",
    HoldingTorqueLevel = "holding-torque-level",
    DetentTorque = "detent-torque",
    MicrostepError = "microstep-error",
    Backlash = "backlash",
    MissedSteps = "missed-steps",
    EncoderEccentricity = "encoder-eccentricity",
    OutsideSquareDrag = "outside-square-drag",
    OutsideHum = "outside-hum",
    OutsideGear = "outside-gear",
    OutsideWander = "outside-wander",
    OutsidePlay = "outside-play",
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
    Nothing,
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

    pub fn listed(self) -> Listed {
        match self {
            Self::CoulombLevel
            | Self::StaticLevel
            | Self::ViscousLevel
            | Self::StribeckVelocity
            | Self::BristleStiffness
            | Self::LoadInertia
            | Self::PressureDependentFriction
            | Self::TemperatureDependentViscosity
            | Self::TemperatureDependentFriction
            | Self::AngleDependentFriction
            | Self::DirectionAsymmetry
            | Self::DwellStiction
            | Self::HydraulicLock
            | Self::FrictionLag
            | Self::PreslidingHysteresis
            | Self::WearDrift
            | Self::FlowTorque
            | Self::PressureTorque
            | Self::PositionTorque
            | Self::CouplingCompliance
            | Self::SensorDelay => Listed::Both,
            Self::TorqueOffset | Self::TorqueGain => Listed::Only(LogKind::Torque),
            Self::HoldingTorqueLevel
            | Self::DetentTorque
            | Self::MicrostepError
            | Self::Backlash
            | Self::MissedSteps
            | Self::EncoderEccentricity => Listed::Only(LogKind::Angle),
            Self::OutsideSquareDrag
            | Self::OutsideHum
            | Self::OutsideGear
            | Self::OutsideWander
            | Self::OutsidePlay => Listed::Nowhere,
        }
    }

    pub fn needs(self) -> Needs {
        match self {
            Self::PressureDependentFriction
            | Self::HydraulicLock
            | Self::FlowTorque
            | Self::PressureTorque => Needs::Pressure,
            Self::TemperatureDependentViscosity | Self::TemperatureDependentFriction => Needs::Temperature,
            Self::CoulombLevel
            | Self::StaticLevel
            | Self::ViscousLevel
            | Self::StribeckVelocity
            | Self::BristleStiffness
            | Self::LoadInertia
            | Self::AngleDependentFriction
            | Self::DirectionAsymmetry
            | Self::DwellStiction
            | Self::FrictionLag
            | Self::PreslidingHysteresis
            | Self::WearDrift
            | Self::PositionTorque
            | Self::CouplingCompliance
            | Self::SensorDelay
            | Self::TorqueOffset
            | Self::TorqueGain
            | Self::HoldingTorqueLevel
            | Self::DetentTorque
            | Self::MicrostepError
            | Self::Backlash
            | Self::MissedSteps
            | Self::EncoderEccentricity
            | Self::OutsideSquareDrag
            | Self::OutsideHum
            | Self::OutsideGear
            | Self::OutsideWander
            | Self::OutsidePlay => Needs::Nothing,
        }
    }
}

//! The names of effects: as an enum for programs, as text for files.

use serde::{Deserialize, Serialize};
use std::fmt;

macro_rules! effect_ids {
    ($($variant:ident = $name:literal,)*) => {
        /// An effect, by the name that diagnosis and model files spell. A match over it names every effect, so that one
        /// that is added is forgotten nowhere.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum EffectId {
            $(
                #[doc = concat!("`", $name, "`")]
                #[serde(rename = $name)]
                $variant,
            )*
        }

        impl EffectId {
            /// Every effect, in the order of the table.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// The name in files.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }
        }
    };
}

effect_ids! {
    CoulombLevel = "coulomb-level",
    StaticLevel = "static-level",
    ViscousLevel = "viscous-level",
    StribeckVelocity = "stribeck-velocity",
    BristleStiffness = "bristle-stiffness",
    LoadInertia = "load-inertia",
    HoldingTorqueLevel = "holding-torque-level",
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
    DetentTorque = "detent-torque",
    MicrostepError = "microstep-error",
    Backlash = "backlash",
    MissedSteps = "missed-steps",
    TorqueOffset = "torque-offset",
    TorqueGain = "torque-gain",
    SensorDelay = "sensor-delay",
    EncoderEccentricity = "encoder-eccentricity",
}

impl EffectId {
    /// The effect that files call so.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|id| id.name() == name)
    }
}

impl fmt::Display for EffectId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

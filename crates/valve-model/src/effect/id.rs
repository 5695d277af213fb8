//! The names of effects: as an enum for programs, as text for files.

use super::label::Label;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;

macro_rules! effect_ids {
    ($($variant:ident = $name:literal,)*) => {
        /// An effect, by the name that diagnosis and model files spell. A match over it names every effect, so that one
        /// that is added is forgotten nowhere.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum EffectId {
            $(
                #[doc = concat!("`", $name, "`")]
                $variant,
            )*
            /// A formula or a table, by the name that its user gave it.
            Custom(Label),
        }

        impl EffectId {
            /// Every effect that has a row in the table, in its order: all but those of users.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// The name of the cause; but for formulas and tables it is the effect's `id` in files, too.
            pub fn name(&self) -> &str {
                match self {
                    $(Self::$variant => $name,)*
                    Self::Custom(name) => name.as_str(),
                }
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
    BristleDamping = "bristle-damping",
    LoadInertia = "load-inertia",
    HoldingTorqueLevel = "holding-torque-level",
    RotorInertia = "rotor-inertia",
    MotorDamping = "motor-damping",
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
    /// The effect of the table that files call so.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|id| id.name() == name)
    }

    /// Whether it is a formula or a table.
    pub fn is_custom(&self) -> bool {
        matches!(self, Self::Custom(_))
    }
}

impl Serialize for EffectId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for EffectId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let custom = || Label::new(&name).map(Self::Custom);
        let refused = || de::Error::invalid_value(de::Unexpected::Str(&name), &"the name of an effect");
        Self::from_name(&name).or_else(custom).ok_or_else(refused)
    }
}

impl fmt::Display for EffectId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

//! What formulas and tables may depend on, and what they act on.

use expression::Dimension;
use serde::{Deserialize, Serialize};

/// A quantity that a formula or a table may depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Covariate {
    /// Angle of the spool, rad.
    Angle,
    /// Speed of the spool, rad/s.
    Speed,
    /// Acceleration of the spool, rad/s².
    Acceleration,
    /// The clock, s: of a log, its `time`; in a simulation, the time since its beginning.
    Time,
    /// Pressure drop over the orifice with its sign, Pa, the mean of a cycle or of two samples.
    PressureDrop,
    /// Temperature of the oil, °C, likewise.
    OilTemperature,
    /// Time at rest, s, as `dwell-stiction` counts it.
    TimeAtRest,
    /// Distance travelled, rad.
    Distance,
}

impl Covariate {
    /// How many there are.
    pub(crate) const COUNT: usize = 8;
    /// The first ones change within a cycle: a law's derivatives are taken by these.
    pub(crate) const MOVING: usize = 4;

    /// All of them.
    pub const ALL: [Self; Self::COUNT] = [
        Self::Angle,
        Self::Speed,
        Self::Acceleration,
        Self::Time,
        Self::PressureDrop,
        Self::OilTemperature,
        Self::TimeAtRest,
        Self::Distance,
    ];

    /// The name in expressions and tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::Speed => "speed",
            Self::Acceleration => "acceleration",
            Self::Time => "time",
            Self::PressureDrop => "pressure_drop",
            Self::OilTemperature => "oil_temperature",
            Self::TimeAtRest => "time_at_rest",
            Self::Distance => "distance",
        }
    }

    /// Its unit.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Angle | Self::Distance => "rad",
            Self::Speed => "rad/s",
            Self::Acceleration => "rad/s^2",
            Self::Time | Self::TimeAtRest => "s",
            Self::PressureDrop => "Pa",
            Self::OilTemperature => "degC",
        }
    }

    /// Its dimension.
    pub fn dimension(self) -> Dimension {
        match self {
            Self::Angle | Self::Distance => Dimension::NONE,
            Self::Speed => Dimension::TIME.to_the(-1.0),
            Self::Acceleration => Dimension::TIME.to_the(-2.0),
            Self::Time | Self::TimeAtRest => Dimension::TIME,
            Self::PressureDrop => Dimension::PRESSURE,
            Self::OilTemperature => Dimension::TEMPERATURE,
        }
    }

    /// What valves have of it: within this range a law must have a finite value.
    pub const fn range(self) -> (f64, f64) {
        match self {
            Self::Angle => (-100.0, 100.0),
            Self::Speed => (-50.0, 50.0),
            Self::Acceleration => (-1e5, 1e5),
            Self::Time => (0.0, 1e5),
            Self::PressureDrop => (-5e7, 5e7),
            Self::OilTemperature => (-40.0, 150.0),
            Self::TimeAtRest => (0.0, 1e5),
            Self::Distance => (0.0, 1e6),
        }
    }

    /// The one that files call so.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|of| of.name() == name)
    }

    /// Its place in [`Self::ALL`].
    pub const fn place(self) -> usize {
        self as usize
    }
}

/// What a formula or a table acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ActsOn {
    /// Adds a torque against the motor, N·m: positive where the motor has to push towards positive angles.
    Torque,
    /// T_c and T_s × (1 + value), the factor at least 0.001.
    Level,
    /// σ2 × (1 + value), the factor at least 0.
    Viscous,
}

impl ActsOn {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Torque, Self::Level, Self::Viscous];

    /// The word in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Torque => "torque",
            Self::Level => "level",
            Self::Viscous => "viscous",
        }
    }

    /// The one that files call so.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|of| of.name() == name)
    }
}

//! The channels that a run may have, their names and units in files.

/// A signal with a meaning that models know. Anything else is an [`crate::Extra`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Channel {
    /// Time on the log's clock, s.
    Time,
    /// Measured valve angle, rad.
    Angle,
    /// Commanded angle, rad; linear between samples.
    AngleCommand,
    /// Torque between motor and load, N·m; positive with positive angle.
    Torque,
    /// Pressure drop over the orifice, Pa.
    PressureDrop,
    /// Flow through the orifice, m³/s.
    Flow,
    /// Oil temperature, °C.
    OilTemperature,
}

impl Channel {
    /// All of them, time and angle, which every run has, first.
    pub const ALL: &'static [Self] = &[
        Self::Time,
        Self::Angle,
        Self::AngleCommand,
        Self::Torque,
        Self::PressureDrop,
        Self::Flow,
        Self::OilTemperature,
    ];

    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Angle => "angle",
            Self::AngleCommand => "angle_command",
            Self::Torque => "torque",
            Self::PressureDrop => "pressure_drop",
            Self::Flow => "flow",
            Self::OilTemperature => "oil_temperature",
        }
    }

    /// Its unit in files.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Time => "s",
            Self::Angle | Self::AngleCommand => "rad",
            Self::Torque => "N*m",
            Self::PressureDrop => "Pa",
            Self::Flow => "m^3/s",
            Self::OilTemperature => "degC",
        }
    }

    /// The channel of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|channel| channel.name() == name)
    }
}

impl core::fmt::Display for Channel {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

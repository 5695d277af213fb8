//! How a simulated device is made: what it is, who it says it is, and what it does without fresh outputs.

/// The kinds that there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A CiA 402 drive in cyclic synchronous position.
    Cia402,
    /// A pulse-train terminal in front of a driver that is always on.
    PulseTrain,
}

/// What the drive does in a cycle without fresh outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnMissed {
    /// Stands.
    Hold,
    /// Goes on as in the last cycle.
    Extrapolate,
}

/// Who the device says it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// Vendor id.
    pub vendor: u32,
    /// Product code.
    pub product: u32,
    /// Revision.
    pub revision: u32,
    /// Serial number.
    pub serial: u32,
    /// Name in SII and 0x1008.
    pub name: String,
}

/// How the device is made.
#[derive(Debug, Clone)]
pub struct Settings {
    /// What it is.
    pub kind: Kind,
    /// Who it is.
    pub identity: Identity,
    /// Without content the EEPROM reads 0xFF everywhere.
    pub empty_sii: bool,
    /// Smallest cycle that it takes (0x1C32:05), ns.
    pub minimum_cycle_ns: u32,
    /// How fast its crystal runs, parts per billion.
    pub drift_ppb: i64,
    /// Cycles from switched on to operation enabled: the current has to come.
    pub enable_cycles: u32,
    /// Cycles until it says that it follows (bit 12).
    pub follow_cycles: u32,
    /// What it does without fresh outputs.
    pub on_missed: OnMissed,
    /// Whether 0x6064 is measured; else it is the command.
    pub position_is_measured: bool,
    /// Difference between the position on the bus and the spool's, micro-steps.
    pub zero_offset: i64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            kind: Kind::Cia402,
            identity: Identity {
                vendor: 0x0000_5356,
                product: 0x0000_0402,
                revision: 0x0001_0000,
                serial: 1,
                name: "SIM-STEPPER".to_owned(),
            },
            empty_sii: false,
            minimum_cycle_ns: 125_000,
            drift_ppb: 0,
            enable_cycles: 5,
            follow_cycles: 1,
            on_missed: OnMissed::Hold,
            position_is_measured: true,
            zero_offset: 0,
        }
    }
}

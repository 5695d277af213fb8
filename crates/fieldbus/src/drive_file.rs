//! What a drive file says: which drive it is, in which units it counts, how it is set.

use crate::objects::Object;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// How a drive is spoken to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// CiA 402, cyclic synchronous position.
    Cia402Csp,
    /// Beckhoff's pulse-train terminal, in continuous position, before a driver with pulse and direction inputs.
    El2522,
}

/// The value of an SDO, in its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SdoValue {
    /// 8 bits.
    U8(u8),
    /// 16 bits.
    U16(u16),
    /// 32 bits.
    U32(u32),
    /// 8 bits, signed.
    I8(i8),
    /// 16 bits, signed.
    I16(i16),
    /// 32 bits, signed.
    I32(i32),
}

impl SdoValue {
    /// As a number.
    pub fn number(self) -> i64 {
        match self {
            Self::U8(value) => value.into(),
            Self::U16(value) => value.into(),
            Self::U32(value) => value.into(),
            Self::I8(value) => value.into(),
            Self::I16(value) => value.into(),
            Self::I32(value) => value.into(),
        }
    }

    /// The number `value` in this value's type; `None` where it doesn't fit.
    pub fn with(self, value: i64) -> Option<Self> {
        Some(match self {
            Self::U8(_) => Self::U8(value.try_into().ok()?),
            Self::U16(_) => Self::U16(value.try_into().ok()?),
            Self::U32(_) => Self::U32(value.try_into().ok()?),
            Self::I8(_) => Self::I8(value.try_into().ok()?),
            Self::I16(_) => Self::I16(value.try_into().ok()?),
            Self::I32(_) => Self::I32(value.try_into().ok()?),
        })
    }
}

/// One setting of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sdo {
    /// Index.
    pub index: u16,
    /// Subindex.
    pub sub: u8,
    /// What is written, and read back.
    pub value: SdoValue,
}

impl Sdo {
    /// Its place.
    pub fn object(&self) -> Object {
        Object { index: self.index, sub: self.sub }
    }
}

/// How the zero is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Homing {
    /// Not at all: the valve is never homed.
    None,
    /// The position is absolute; this many units on the bus are the valve's zero.
    Absolute {
        /// Units on the bus at the valve's zero.
        offset: i64,
    },
    /// By the drive itself (CiA 402, mode 6), when an operator orders it; what it counts from is the valve's zero.
    Drive {
        /// 0x6098: 37 or 35 takes the present position; others move.
        method: i8,
    },
}

/// A drive, as its file describes it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DriveFile {
    /// Its name, for people.
    pub name: String,
    /// How it is spoken to.
    pub profile: Profile,
    /// Vendor id.
    pub vendor: u32,
    /// Product code.
    pub product: u32,
    /// The lowest revision that is known to fit.
    pub revision_min: u32,
    /// Position units of a revolution: the model's micro-steps.
    pub units_per_rev: u32,
    /// Whether positive counts turn the valve towards smaller angles.
    pub reversed: bool,
    /// Whether 0x6064 is measured; an open-loop drive gives back its command.
    pub position_is_measured: bool,
    /// SYNC0 after the beginning of the bus's cycle, ns.
    pub sync_shift_ns: u32,
    /// Cycles in a row without a good reply that are a lost bus.
    pub bus_lost_cycles: u64,
    /// How long enabling may take, ns.
    pub enable_timeout_ns: u64,
    /// How the zero is found.
    pub homing: Homing,
    /// Objects of the bring-up, or of the process data, that this drive does not have.
    pub absent: Vec<(u16, u8)>,
    /// Settings of its own, written first.
    pub sdos: Vec<Sdo>,
}

/// A number that no drive can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("`{key}` is {found}, expected {expected}")]
pub struct DriveFileError {
    /// The key.
    pub key: &'static str,
    /// What was found.
    pub found: u64,
    /// What would have been accepted.
    pub expected: &'static str,
}

impl DriveFile {
    /// Checks the numbers.
    ///
    /// # Errors
    /// The first that can't be.
    pub fn validate(&self) -> Result<(), DriveFileError> {
        let wrong = |key, found, expected| Err(DriveFileError { key, found, expected });
        if self.units_per_rev == 0 {
            return wrong("units_per_rev", 0, "1 or more");
        }
        if !(1..=1000).contains(&self.bus_lost_cycles) {
            return wrong("faults.bus_lost_cycles", self.bus_lost_cycles, "1 to 1000");
        }
        if self.enable_timeout_ns == 0 {
            return wrong("faults.enable_timeout", 0, "more than 0");
        }
        Ok(())
    }

    /// 1 or −1: the valve's angle for a count of the drive.
    pub fn direction(&self) -> i64 {
        if self.reversed { -1 } else { 1 }
    }

    /// Whether the drive lacks an object of the bring-up.
    pub fn lacks(&self, object: Object) -> bool {
        self.absent.contains(&(object.index, object.sub))
    }
}

//! What can be wrong with the link, and with a device that is brought up: what was found, and what was expected.

use fieldbus::Mismatch;
use fieldbus::objects::Object;
use realtime::PacketError;
use thiserror::Error;

/// A link that does not carry frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum LinkError {
    /// The socket.
    #[error(transparent)]
    Packet(#[from] PacketError),
    /// Only a part of a frame was taken.
    #[error("{sent} bytes of a frame were sent, expected {expected}")]
    Cut {
        /// Bytes sent.
        sent: usize,
        /// Bytes of the frame.
        expected: usize,
    },
    /// The link is down.
    #[error("the link is down")]
    Down,
}

/// What the bring-up was doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Counting devices, giving addresses, reading SII, to PRE-OP.
    Init,
    /// Registers.
    Registers,
    /// FMMUs and sync managers.
    ProcessData,
    /// To SAFE-OP.
    SafeOp,
    /// To OP.
    Op,
}

impl core::fmt::Display for Step {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Init => "from INIT to PRE-OP",
            Self::Registers => "registers",
            Self::ProcessData => "process data",
            Self::SafeOp => "from PRE-OP to SAFE-OP",
            Self::Op => "from SAFE-OP to OP",
        })
    }
}

/// Why a device can't be brought up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum BringUpError {
    /// Nobody answers, or not as many as there should be.
    #[error("{found} devices on the bus, expected {expected}")]
    Count {
        /// Devices that answer.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// Another device than the drive file describes.
    #[error("the device's {what} is {found:#010x}, expected {expected:#010x}{}", if *.at_least { " or later" } else { "" })]
    Identity {
        /// vendor, product, revision.
        what: &'static str,
        /// What SII says.
        found: u32,
        /// What the drive file says.
        expected: u32,
        /// Whether larger values fit too.
        at_least: bool,
    },
    /// An object that could not be read or written.
    #[error("{object}: {} refused: {error}, expected {expected}", if *.write { "write" } else { "read" })]
    Sdo {
        /// Which.
        object: Object,
        /// Whether it was written.
        write: bool,
        /// What was to be written, or found.
        expected: i64,
        /// The device's abort code, or what went wrong on the way.
        error: ethercrab::error::Error,
    },
    /// An object with another value.
    #[error(transparent)]
    Mismatch(#[from] Mismatch),
    /// A register that does not take its value.
    #[error("register {register:#06x} is {found}, expected {expected}")]
    Register {
        /// Its address.
        register: u16,
        /// What it reads.
        found: u64,
        /// What was written.
        expected: u64,
    },
    /// Process data of another size.
    #[error("{what} of {found} bytes, expected {expected}")]
    Size {
        /// outputs, inputs.
        what: &'static str,
        /// What the device's PDOs come to.
        found: usize,
        /// What the profile needs.
        expected: usize,
    },
    /// The device has no distributed clock.
    #[error("the device has no distributed clock, expected one of 64 bits")]
    NoClock,
    /// A state was refused.
    #[error("{step}: refused, AL status {al_status:#04x}, code {al_code:#06x} ({})", al_code_name(*.al_code))]
    State {
        /// Which step.
        step: Step,
        /// AL status.
        al_status: u16,
        /// AL status code.
        al_code: u16,
    },
    /// The clock did not come near enough to the bus's.
    #[error(
        "the cycle was within {expected_ns} ns of the bus's clock {near} times more than it was not, expected {wanted} (last {error_ns} ns off)"
    )]
    NotLocked {
        /// Cycles near the clock, less those that were not, which count more.
        near: u64,
        /// How many are wanted.
        wanted: u64,
        /// Last deviation, ns.
        error_ns: i64,
        /// Window, ns.
        expected_ns: i64,
    },
    /// Frames without replies, or replies that don't fit.
    #[error("{step}: {error}")]
    Bus {
        /// Which step.
        step: Step,
        /// What ethercrab says.
        error: ethercrab::error::Error,
    },
    /// The whole took too long.
    #[error("not brought up within {limit_ns} ns")]
    Timeout {
        /// The limit, ns.
        limit_ns: u64,
    },
}

/// The names of the AL status codes that a drive gives most (ETG.1000.6, table 11).
fn al_code_name(code: u16) -> &'static str {
    match code {
        0x0000 => "no error",
        0x0011 => "invalid requested state change",
        0x0016 => "invalid mailbox configuration",
        0x001A => "synchronisation error",
        0x001B => "sync manager watchdog",
        0x001D => "invalid output configuration",
        0x001E => "invalid input configuration",
        0x002C => "fatal sync error",
        0x002D => "no sync error",
        0x0030 => "invalid DC SYNC configuration",
        0x0032 => "PLL error",
        0x0035 => "invalid sync cycle time",
        0x0036 => "invalid SYNC0 cycle time",
        _ => "see the drive's manual",
    }
}

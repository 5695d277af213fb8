//! Object numbers beside their names (CiA 402-2, ETG.1000.6): index and subindex.

/// An object's place in the dictionary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Object {
    /// Index.
    pub index: u16,
    /// Subindex.
    pub sub: u8,
}

impl core::fmt::Display for Object {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "0x{:04X}:{:02X}", self.index, self.sub)
    }
}

const fn object(index: u16, sub: u8) -> Object {
    Object { index, sub }
}

/// Abort connection option code: what the drive does when the bus goes away.
pub const ABORT_CONNECTION: Object = object(0x6007, 0);
/// Error code of the last fault.
pub const ERROR_CODE: Object = object(0x603F, 0);
/// Control word.
pub const CONTROL_WORD: Object = object(0x6040, 0);
/// Status word.
pub const STATUS_WORD: Object = object(0x6041, 0);
/// Quick stop option code: 2 ramps at 0x6085, then switch-on disabled.
pub const QUICK_STOP_OPTION: Object = object(0x605A, 0);
/// Mode of operation: 8 is cyclic synchronous position, 6 is homing.
pub const MODE: Object = object(0x6060, 0);
/// Mode of operation as the drive took it.
pub const MODE_DISPLAY: Object = object(0x6061, 0);
/// Position actual value.
pub const POSITION_ACTUAL: Object = object(0x6064, 0);
/// Target position.
pub const TARGET_POSITION: Object = object(0x607A, 0);
/// Highest speed of the motor, rpm.
pub const MAX_MOTOR_SPEED: Object = object(0x6080, 0);
/// Quick stop deceleration, position units per s².
pub const QUICK_STOP_DECELERATION: Object = object(0x6085, 0);
/// Position encoder resolution: increments.
pub const ENCODER_INCREMENTS: Object = object(0x608F, 1);
/// Position encoder resolution: motor revolutions.
pub const ENCODER_REVOLUTIONS: Object = object(0x608F, 2);
/// Gear ratio: motor revolutions.
pub const GEAR_MOTOR: Object = object(0x6091, 1);
/// Gear ratio: shaft revolutions.
pub const GEAR_SHAFT: Object = object(0x6091, 2);
/// Feed constant: position units.
pub const FEED_UNITS: Object = object(0x6092, 1);
/// Feed constant: shaft revolutions.
pub const FEED_REVOLUTIONS: Object = object(0x6092, 2);
/// Home offset.
pub const HOME_OFFSET: Object = object(0x607C, 0);
/// Homing method.
pub const HOMING_METHOD: Object = object(0x6098, 0);
/// Velocity offset: feed-forward of the rate.
pub const VELOCITY_OFFSET: Object = object(0x60B1, 0);
/// Interpolation time: value.
pub const INTERPOLATION_VALUE: Object = object(0x60C2, 1);
/// Interpolation time: power of ten of a second.
pub const INTERPOLATION_EXPONENT: Object = object(0x60C2, 2);
/// Following error: command less position.
pub const FOLLOWING_ERROR: Object = object(0x60F4, 0);
/// Digital inputs.
pub const DIGITAL_INPUTS: Object = object(0x60FD, 0);
/// Supported modes: bit 7 is cyclic synchronous position, bit 5 is homing.
pub const SUPPORTED_MODES: Object = object(0x6502, 0);
/// Identity: vendor.
pub const VENDOR: Object = object(0x1018, 1);
/// Identity: product code.
pub const PRODUCT: Object = object(0x1018, 2);
/// Identity: revision.
pub const REVISION: Object = object(0x1018, 3);

/// PDO assignment of the outputs (sync manager 2), by place; 0 is the count.
pub const fn outputs_assignment(place: u8) -> Object {
    object(0x1C12, place)
}

/// PDO assignment of the inputs (sync manager 3), by place; 0 is the count.
pub const fn inputs_assignment(place: u8) -> Object {
    object(0x1C13, place)
}

/// Synchronisation type of outputs (0x1C32) or inputs (0x1C33): 2 is SYNC0.
pub const fn synchronisation(outputs: bool) -> Object {
    object(if outputs { 0x1C32 } else { 0x1C33 }, 1)
}

/// Cycle time of outputs or inputs, ns.
pub const fn cycle_time(outputs: bool) -> Object {
    object(if outputs { 0x1C32 } else { 0x1C33 }, 2)
}

/// Minimum cycle time of outputs or inputs, ns.
pub const fn minimum_cycle(outputs: bool) -> Object {
    object(if outputs { 0x1C32 } else { 0x1C33 }, 5)
}

/// Any other object, by its numbers.
pub const fn other(index: u16, sub: u8) -> Object {
    object(index, sub)
}

//! Process data: which objects a frame carries for each profile, and their bytes.

use crate::drive_file::Profile;
use crate::objects::{self, Object};

/// Objects with their widths in bits, in the order of the wire.
pub type Mapping = &'static [(Object, u8)];

const CIA402_OUTPUTS: Mapping = &[
    (objects::CONTROL_WORD, 16),
    (objects::TARGET_POSITION, 32),
    (objects::MODE, 8),
    (objects::VELOCITY_OFFSET, 32),
];

const CIA402_INPUTS: Mapping = &[
    (objects::STATUS_WORD, 16),
    (objects::POSITION_ACTUAL, 32),
    (objects::MODE_DISPLAY, 8),
    (objects::ERROR_CODE, 16),
    (objects::DIGITAL_INPUTS, 32),
    (objects::FOLLOWING_ERROR, 32),
];

const PULSE_TRAIN_OUTPUTS: Mapping =
    &[(objects::other(0x7000, 0x11), 16), (objects::other(0x7000, 0x12), 32)];
const PULSE_TRAIN_INPUTS: Mapping = &[(objects::other(0x6000, 0x01), 16), (objects::other(0x6020, 0x11), 32)];

impl Profile {
    /// What a frame carries to the drive.
    pub const fn outputs(self) -> Mapping {
        match self {
            Self::Cia402Csp => CIA402_OUTPUTS,
            Self::El2522 => PULSE_TRAIN_OUTPUTS,
        }
    }

    /// What it brings back.
    pub const fn inputs(self) -> Mapping {
        match self {
            Self::Cia402Csp => CIA402_INPUTS,
            Self::El2522 => PULSE_TRAIN_INPUTS,
        }
    }

    /// Bytes of the outputs, and of the inputs.
    pub fn sizes(self) -> (usize, usize) {
        (bytes(self.outputs()), bytes(self.inputs()))
    }

    /// The PDOs: of the outputs, of the inputs.
    pub const fn pdos(self) -> (u16, u16) {
        match self {
            Self::Cia402Csp => (0x1600, 0x1A00),
            Self::El2522 => (0x160B, 0x1A0B),
        }
    }
}

/// Bytes of a mapping.
pub(crate) fn bytes(mapping: Mapping) -> usize {
    mapping.iter().map(|(_, bits)| usize::from(*bits) / 8).sum()
}

/// What the bridge tells the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Outputs {
    /// Control word.
    pub control: u16,
    /// Target position, in the drive's units.
    pub target: i32,
    /// Mode of operation.
    pub mode: i8,
    /// Rate, units per second, as feed-forward.
    pub velocity_offset: i32,
}

/// No profile's outputs are longer, bytes.
const MAX_OUTPUTS: usize = 16;

impl Outputs {
    /// The bytes of a profile's outputs, and how many they are.
    pub fn pack(&self, profile: Profile) -> ([u8; MAX_OUTPUTS], usize) {
        let mut packed = Packed { bytes: [0; MAX_OUTPUTS], at: 0 };
        packed.push(&self.control.to_le_bytes());
        packed.push(&self.target.to_le_bytes());
        if profile == Profile::Cia402Csp {
            packed.push(&self.mode.to_le_bytes());
            packed.push(&self.velocity_offset.to_le_bytes());
        }
        (packed.bytes, packed.at)
    }
}

struct Packed {
    bytes: [u8; MAX_OUTPUTS],
    at: usize,
}

impl Packed {
    fn push(&mut self, value: &[u8]) {
        if let Some(place) = self.bytes.get_mut(self.at..self.at + value.len()) {
            place.copy_from_slice(value);
            self.at += value.len();
        }
    }
}

/// What the drive tells the bridge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Inputs {
    /// Status word.
    pub status: u16,
    /// Position actual value, or the counter of pulses.
    pub position: i32,
    /// Mode of operation as the drive took it.
    pub mode: i8,
    /// Error code.
    pub error_code: u16,
    /// Digital inputs.
    pub digital_inputs: u32,
    /// Command less position.
    pub following_error: i32,
}

impl Inputs {
    /// Reads a profile's inputs; `None` where there are not as many bytes.
    pub fn unpack(profile: Profile, data: &[u8]) -> Option<Self> {
        if data.len() != bytes(profile.inputs()) {
            return None;
        }
        let (status, rest) = data.split_first_chunk::<2>()?;
        let (position, rest) = rest.split_first_chunk::<4>()?;
        let both = Self {
            status: u16::from_le_bytes(*status),
            position: i32::from_le_bytes(*position),
            ..Self::default()
        };
        if profile == Profile::El2522 {
            return Some(both);
        }
        let (mode, rest) = rest.split_first_chunk::<1>()?;
        let (error_code, rest) = rest.split_first_chunk::<2>()?;
        let (digital_inputs, rest) = rest.split_first_chunk::<4>()?;
        let following_error = rest.first_chunk::<4>()?;
        Some(Self {
            mode: i8::from_le_bytes(*mode),
            error_code: u16::from_le_bytes(*error_code),
            digital_inputs: u32::from_le_bytes(*digital_inputs),
            following_error: i32::from_le_bytes(*following_error),
            ..both
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bytes_are_as_many_as_the_mapping_says() {
        for profile in [Profile::Cia402Csp, Profile::El2522] {
            assert_eq!(Outputs::default().pack(profile).1, bytes(profile.outputs()));
            assert!(Inputs::unpack(profile, &vec![0; bytes(profile.inputs())]).is_some());
            assert!(Inputs::unpack(profile, &vec![0; bytes(profile.inputs()) + 1]).is_none());
        }
    }

    #[test]
    fn outputs_lie_where_the_mapping_says() {
        let outputs = Outputs { control: 0x0F, target: -2, mode: 8, velocity_offset: 0x0102_0304 };
        let (packed, size) = outputs.pack(Profile::Cia402Csp);
        assert_eq!(packed[..size], [0x0F, 0, 0xFE, 0xFF, 0xFF, 0xFF, 8, 4, 3, 2, 1]);
        let inputs = [0x37, 0x12, 0xFF, 0xFF, 0xFF, 0x7F, 8, 0x11, 0x86, 1, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF];
        let read = Inputs::unpack(Profile::Cia402Csp, &inputs).unwrap();
        assert_eq!((read.status, read.position, read.mode), (0x1237, i32::MAX, 8));
        assert_eq!((read.error_code, read.digital_inputs, read.following_error), (0x8611, 1, -1));
    }
}

//! Process data: which objects a frame carries for each profile, and their bytes.

use crate::drive_file::{DriveFile, Profile};
use crate::objects::{self, Object};
use serde::{Deserialize, Serialize};

/// Objects with their widths in bits, in the order of the wire.
type Mapping = &'static [(Object, u8)];

/// What a drive may lack: feed-forward of the speed, and what is told beside position and state. All else is needed.
pub(crate) const OPTIONAL: [Object; 4] =
    [objects::VELOCITY_OFFSET, objects::ERROR_CODE, objects::DIGITAL_INPUTS, objects::FOLLOWING_ERROR];

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
    const fn outputs(self) -> Mapping {
        match self {
            Self::Cia402Csp => CIA402_OUTPUTS,
            Self::El2522 => PULSE_TRAIN_OUTPUTS,
        }
    }

    const fn inputs(self) -> Mapping {
        match self {
            Self::Cia402Csp => CIA402_INPUTS,
            Self::El2522 => PULSE_TRAIN_INPUTS,
        }
    }

    /// The PDOs: of the outputs, of the inputs.
    pub const fn pdos(self) -> (u16, u16) {
        match self {
            Self::Cia402Csp => (0x1600, 0x1A00),
            Self::El2522 => (0x160B, 0x1A0B),
        }
    }

    /// Whether no frame can do without an object.
    pub fn needs(self, object: Object) -> bool {
        let carried = self.outputs().iter().chain(self.inputs()).any(|(of, _)| *of == object);
        carried && !self.can_do_without(object)
    }

    /// Whether frames carry an object only where the drive has it.
    pub fn can_do_without(self, object: Object) -> bool {
        self == Self::Cia402Csp && OPTIONAL.contains(&object)
    }
}

impl DriveFile {
    /// What frames carry.
    pub fn layout(&self) -> Layout {
        Layout::new(self.profile, |object| self.lacks(object))
    }
}

/// What frames carry to and from a drive: all of its profile, less what it lacks and nobody needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Layout {
    profile: Profile,
    /// By place in [`OPTIONAL`].
    lacks: [bool; OPTIONAL.len()],
}

impl Layout {
    /// Of a drive that lacks some objects.
    pub fn new(profile: Profile, lacks: impl Fn(Object) -> bool) -> Self {
        Self { profile, lacks: OPTIONAL.map(|object| profile == Profile::Cia402Csp && lacks(object)) }
    }

    fn has(self, object: Object) -> bool {
        !OPTIONAL.iter().zip(self.lacks).any(|(of, lacks)| lacks && *of == object)
    }

    fn kept(self, mapping: Mapping) -> impl Iterator<Item = (Object, u8)> {
        mapping.iter().copied().filter(move |(object, _)| self.has(*object))
    }

    /// What a frame carries to the drive: objects with their widths in bits, in the order of the wire.
    pub fn outputs(self) -> impl Iterator<Item = (Object, u8)> {
        self.kept(self.profile.outputs())
    }

    /// What it brings back.
    pub fn inputs(self) -> impl Iterator<Item = (Object, u8)> {
        self.kept(self.profile.inputs())
    }

    /// Bytes of the outputs, and of the inputs.
    pub fn sizes(self) -> (usize, usize) {
        (bytes(self.outputs()), bytes(self.inputs()))
    }
}

fn bytes(mapping: impl Iterator<Item = (Object, u8)>) -> usize {
    mapping.map(|(_, bits)| usize::from(bits) / 8).sum()
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
    /// The bytes of the outputs, and how many they are.
    pub fn pack(&self, layout: Layout) -> ([u8; MAX_OUTPUTS], usize) {
        let mut packed = Packed { bytes: [0; MAX_OUTPUTS], at: 0 };
        packed.push(&self.control.to_le_bytes());
        packed.push(&self.target.to_le_bytes());
        if layout.profile == Profile::Cia402Csp {
            packed.push(&self.mode.to_le_bytes());
            if layout.has(objects::VELOCITY_OFFSET) {
                packed.push(&self.velocity_offset.to_le_bytes());
            }
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
    /// Reads the inputs, 0 where the drive lacks one; `None` where there are not as many bytes.
    pub fn unpack(layout: Layout, data: &[u8]) -> Option<Self> {
        if data.len() != bytes(layout.inputs()) {
            return None;
        }
        let (status, rest) = data.split_first_chunk::<2>()?;
        let (position, mut rest) = rest.split_first_chunk::<4>()?;
        let mut read = Self {
            status: u16::from_le_bytes(*status),
            position: i32::from_le_bytes(*position),
            ..Self::default()
        };
        if layout.profile == Profile::El2522 {
            return Some(read);
        }
        read.mode = i8::from_le_bytes(taken(&mut rest)?);
        if layout.has(objects::ERROR_CODE) {
            read.error_code = u16::from_le_bytes(taken(&mut rest)?);
        }
        if layout.has(objects::DIGITAL_INPUTS) {
            read.digital_inputs = u32::from_le_bytes(taken(&mut rest)?);
        }
        if layout.has(objects::FOLLOWING_ERROR) {
            read.following_error = i32::from_le_bytes(taken(&mut rest)?);
        }
        Some(read)
    }
}

fn taken<const COUNT: usize>(rest: &mut &[u8]) -> Option<[u8; COUNT]> {
    let (first, behind) = rest.split_first_chunk::<COUNT>()?;
    *rest = behind;
    Some(*first)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: fn(Object) -> bool = |_| false;

    #[test]
    fn the_bytes_are_as_many_as_the_mapping_says() {
        for profile in [Profile::Cia402Csp, Profile::El2522] {
            for lacking in 0..1 << OPTIONAL.len() {
                let lacks = |object| {
                    OPTIONAL.iter().position(|of| *of == object).is_some_and(|at| lacking >> at & 1 == 1)
                };
                let layout = Layout::new(profile, lacks);
                let (outputs, inputs) = layout.sizes();
                assert_eq!(Outputs::default().pack(layout).1, outputs);
                assert!(Inputs::unpack(layout, &vec![0; inputs]).is_some());
                assert!(Inputs::unpack(layout, &vec![0; inputs + 1]).is_none());
            }
        }
    }

    #[test]
    fn outputs_lie_where_the_mapping_says() {
        let layout = Layout::new(Profile::Cia402Csp, ALL);
        let outputs = Outputs { control: 0x0F, target: -2, mode: 8, velocity_offset: 0x0102_0304 };
        let (packed, size) = outputs.pack(layout);
        assert_eq!(packed[..size], [0x0F, 0, 0xFE, 0xFF, 0xFF, 0xFF, 8, 4, 3, 2, 1]);
        let inputs = [0x37, 0x12, 0xFF, 0xFF, 0xFF, 0x7F, 8, 0x11, 0x86, 1, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF];
        let read = Inputs::unpack(layout, &inputs).unwrap();
        assert_eq!((read.status, read.position, read.mode), (0x1237, i32::MAX, 8));
        assert_eq!((read.error_code, read.digital_inputs, read.following_error), (0x8611, 1, -1));
    }

    #[test]
    fn what_a_drive_lacks_is_left_out_and_the_rest_moves_up() {
        let lacks = |object| object == objects::VELOCITY_OFFSET || object == objects::DIGITAL_INPUTS;
        let layout = Layout::new(Profile::Cia402Csp, lacks);
        let outputs = Outputs { control: 0x0F, target: -2, mode: 8, velocity_offset: 7 };
        let (packed, size) = outputs.pack(layout);
        assert_eq!(packed[..size], [0x0F, 0, 0xFE, 0xFF, 0xFF, 0xFF, 8]);
        let inputs = [0x37, 0x12, 0xFF, 0xFF, 0xFF, 0x7F, 8, 0x11, 0x86, 0xFF, 0xFF, 0xFF, 0xFF];
        let read = Inputs::unpack(layout, &inputs).unwrap();
        assert_eq!((read.error_code, read.digital_inputs, read.following_error), (0x8611, 0, -1));
        assert!(
            Profile::Cia402Csp.needs(objects::MODE_DISPLAY) && !Profile::Cia402Csp.needs(objects::ERROR_CODE)
        );
    }
}

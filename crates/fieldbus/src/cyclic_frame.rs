//! The one frame of a cycle (ETG.1000.4): the bus's clock (FRMW of 0x0910), the process data (LRW, inputs before outputs), the
//! AL state and code (FPRD of 0x0130), and, where a state is asked for, FPWR of 0x0120. Built into a fixed buffer, read back
//! from fixed places.

use thiserror::Error;

/// No frame of a drive is longer, bytes.
pub const MAX_FRAME: usize = 256;

/// Working counter of the process data when one device read and wrote it.
const READ_AND_WRITTEN: u16 = 3;

const ETHERTYPE: u16 = 0x88A4;
const ETHERNET: usize = 14;
const HEADER: usize = 2;
const DATAGRAM: usize = 10;
const COUNTER: usize = 2;

const SYSTEM_TIME: u16 = 0x0910;
const AL_STATUS: u16 = 0x0130;
const AL_CONTROL: u16 = 0x0120;
const AL_BYTES: usize = 6;

/// As many frames are told apart: 4.6 h of them at 1 kHz.
const INDEX_MASK: u32 = 0x00FF_FFFF;

/// EtherCAT commands (ETG.1000.4, table 4).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Command {
    Fprd = 4,
    Fpwr = 5,
    Lrw = 12,
    Frmw = 14,
}

/// A reply that is none to the frame that was sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum FrameError {
    /// Too short, or too long.
    #[error("{found} bytes, expected {expected}")]
    Length {
        /// Bytes received.
        found: usize,
        /// Bytes sent.
        expected: usize,
    },
    /// Another protocol.
    #[error("EtherType {found:#06x}, expected 0x88a4")]
    EtherType {
        /// What the frame says.
        found: u16,
    },
    /// Our own frame, as nobody changed it.
    #[error("a frame that went through no device")]
    Unprocessed,
    /// A reply to another cycle's frame: late, or twice.
    #[error("index {found}, expected {expected}")]
    Index {
        /// The index received.
        found: u32,
        /// The index of this cycle's frame.
        expected: u32,
    },
    /// A datagram is not the one that was sent in its place.
    #[error("the datagram at byte {at} is not the one that was sent")]
    Datagram {
        /// Where it begins.
        at: usize,
    },
}

/// What a reply says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reply<'a> {
    /// The bus's time when the frame passed the device, ns.
    pub system_time_ns: u64,
    /// Whether the device was there and told its time and state.
    pub reached: bool,
    /// Working counter of the process data.
    pub working_counter: u16,
    /// The inputs; good only where `working_counter` is right.
    pub inputs: &'a [u8],
    /// AL status: the state in bits 0 to 3, the error in bit 4.
    pub al_status: u16,
    /// AL status code.
    pub al_code: u16,
}

impl Reply<'_> {
    /// Whether the process data were read and written.
    pub fn exchanged(&self) -> bool {
        self.reached && self.working_counter == READ_AND_WRITTEN
    }
}

/// Builds each cycle's frame and reads its reply.
#[derive(Debug, Clone)]
pub struct CyclicFrame {
    buffer: [u8; MAX_FRAME],
    length: usize,
    /// Counts frames. Its three lower bytes are the indices of the first three datagrams: one alone would come again after 256
    /// cycles, and so many replies may wait where a device stood still.
    index: u32,
    station: u16,
    logical_address: u32,
    inputs: usize,
    outputs: usize,
}

impl CyclicFrame {
    /// Frames for the device with this station address, whose inputs and then outputs lie from `logical_address` on; `None`
    /// where they don't fit a frame.
    pub fn new(station: u16, logical_address: u32, inputs: usize, outputs: usize) -> Option<Self> {
        let frame =
            Self { buffer: [0; MAX_FRAME], length: 0, index: 0, station, logical_address, inputs, outputs };
        (frame.fixed_length() + DATAGRAM + 2 + COUNTER <= MAX_FRAME).then_some(frame)
    }

    fn process_data_at(&self) -> usize {
        ETHERNET + HEADER + DATAGRAM + 8 + COUNTER
    }

    fn al_at(&self) -> usize {
        self.process_data_at() + DATAGRAM + self.inputs + self.outputs + COUNTER
    }

    fn fixed_length(&self) -> usize {
        self.al_at() + DATAGRAM + AL_BYTES + COUNTER
    }

    /// The frame of the next cycle, with a request for an AL state where one is wanted.
    pub fn build(&mut self, outputs: &[u8], al_request: Option<u16>) -> &[u8] {
        self.index = self.index.wrapping_add(1);
        self.buffer = [0; MAX_FRAME];
        self.length = self.fixed_length();
        let more = al_request.is_some();
        let logical = (self.logical_address as u16, (self.logical_address >> 16) as u16);
        self.put(0, &[0xFF; 6]);
        self.put(6, &[0x10; 6]);
        self.put(12, &ETHERTYPE.to_be_bytes());
        self.datagram(ETHERNET + HEADER, 0, Command::Frmw, (self.station, SYSTEM_TIME), 8, true);
        let (data_at, size) = (self.process_data_at(), self.inputs + self.outputs);
        self.datagram(data_at, 1, Command::Lrw, logical, size, true);
        self.put(data_at + DATAGRAM + self.inputs, outputs.get(..self.outputs).unwrap_or(outputs));
        self.datagram(self.al_at(), 2, Command::Fprd, (self.station, AL_STATUS), AL_BYTES, more);
        if let Some(state) = al_request {
            let at = self.length;
            self.length += DATAGRAM + 2 + COUNTER;
            self.datagram(at, 3, Command::Fpwr, (self.station, AL_CONTROL), 2, false);
            self.put(at + DATAGRAM, &state.to_le_bytes());
        }
        let payload = (self.length - ETHERNET - HEADER) as u16;
        self.put(ETHERNET, &(payload | 0x1000).to_le_bytes());
        self.buffer.get(..self.length).unwrap_or(&[])
    }

    fn put(&mut self, at: usize, bytes: &[u8]) {
        if let Some(place) = self.buffer.get_mut(at..at + bytes.len()) {
            place.copy_from_slice(bytes);
        }
    }

    fn datagram(
        &mut self,
        at: usize,
        place: usize,
        command: Command,
        address: (u16, u16),
        size: usize,
        more: bool,
    ) {
        let length = size as u16 | if more { 0x8000 } else { 0 };
        let [index, ..] = (self.index >> (8 * place)).to_le_bytes();
        self.put(at, &[command as u8, index]);
        self.put(at + 2, &address.0.to_le_bytes());
        self.put(at + 4, &address.1.to_le_bytes());
        self.put(at + 6, &length.to_le_bytes());
    }

    /// Reads a reply to the last frame.
    ///
    /// # Errors
    /// [`FrameError`] for anything else than that frame come back.
    pub fn read<'a>(&self, reply: &'a [u8]) -> Result<Reply<'a>, FrameError> {
        let word = |at: usize| reply.get(at..).and_then(<[u8]>::first_chunk::<2>).copied().unwrap_or([0; 2]);
        if reply.len() < ETHERNET + HEADER + DATAGRAM {
            return Err(FrameError::Length { found: reply.len(), expected: self.length });
        }
        let found = u16::from_be_bytes(word(12));
        if found != ETHERTYPE {
            return Err(FrameError::EtherType { found });
        }
        if reply.get(6..12) == Some(&[0x10; 6]) {
            return Err(FrameError::Unprocessed);
        }
        // Short frames come padded to Ethernet's 60 bytes.
        if reply.len() != self.length.max(60) && reply.len() != self.length {
            return Err(FrameError::Length { found: reply.len(), expected: self.length });
        }
        let places = [ETHERNET + HEADER, self.process_data_at(), self.al_at()];
        let [first, second, third] = places.map(|at| reply.get(at + 1).copied().unwrap_or(0));
        let found = u32::from_le_bytes([first, second, third, 0]);
        let expected = self.index & INDEX_MASK;
        if found != expected {
            return Err(FrameError::Index { found, expected });
        }
        for at in places {
            // Command, index, address; length and more.
            if reply.get(at..at + 8) != self.buffer.get(at..at + 8) {
                return Err(FrameError::Datagram { at });
            }
        }
        let time_at = ETHERNET + HEADER + DATAGRAM;
        let time = reply.get(time_at..).and_then(<[u8]>::first_chunk::<8>).copied().unwrap_or([0; 8]);
        let data_at = self.process_data_at() + DATAGRAM;
        let al_at = self.al_at() + DATAGRAM;
        Ok(Reply {
            system_time_ns: u64::from_le_bytes(time),
            reached: u16::from_le_bytes(word(time_at + 8)) == 1
                && u16::from_le_bytes(word(al_at + AL_BYTES)) == 1,
            working_counter: u16::from_le_bytes(word(data_at + self.inputs + self.outputs)),
            inputs: reply.get(data_at..data_at + self.inputs).unwrap_or(&[]),
            al_status: u16::from_le_bytes(word(al_at)),
            al_code: u16::from_le_bytes(word(al_at + 4)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn answered(frame: &[u8]) -> Vec<u8> {
        let mut reply = frame.to_vec();
        reply[6] |= 2;
        reply[34] = 1;
        reply
    }

    #[test]
    fn only_this_cycles_reply_is_read() {
        let mut frames = CyclicFrame::new(0x1000, 0, 17, 11).unwrap();
        let first = answered(frames.build(&[1; 11], None));
        assert_eq!(frames.read(&first).unwrap().working_counter, 0);
        let second = answered(frames.build(&[1; 11], None));
        assert_eq!(frames.read(&first), Err(FrameError::Index { found: 1, expected: 2 }));
        assert!(frames.read(&second).is_ok());
        let sent = frames.build(&[1; 11], None).to_vec();
        assert_eq!(frames.read(&sent), Err(FrameError::Unprocessed));
    }

    /// A device that stood still for a quarter of a second and more answers everything at once.
    #[test]
    fn a_reply_of_256_cycles_ago_is_none() {
        let mut frames = CyclicFrame::new(0x1000, 0, 17, 11).unwrap();
        for cycles in [256, 0x1_0000] {
            let old = answered(frames.build(&[1; 11], None));
            for _ in 0..cycles {
                frames.build(&[1; 11], None);
            }
            assert!(matches!(frames.read(&old), Err(FrameError::Index { .. })), "{cycles} cycles");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..300), inputs in 0_usize..40, outputs in 0_usize..40) {
            let mut frames = CyclicFrame::new(0x1000, 0, inputs, outputs).unwrap();
            let mut reply = answered(frames.build(&[], Some(8)));
            let _ = frames.read(&bytes);
            for (place, byte) in reply.iter_mut().skip(14).zip(&bytes) {
                *place ^= *byte;
            }
            if let Ok(read) = frames.read(&reply) {
                prop_assert_eq!(read.inputs.len(), inputs);
            }
        }
    }
}

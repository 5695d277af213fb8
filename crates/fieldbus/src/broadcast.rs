//! A frame that asks all devices for their AL status at once (BRD of 0x0130): who is there, without changing anything.

const ETHERTYPE: [u8; 2] = [0x88, 0xA4];
/// Shortest Ethernet frame without its checksum, bytes.
const FRAME: usize = 60;
const DATAGRAM: usize = 16;
const BROADCAST_READ: u8 = 7;
const AL_STATUS: u16 = 0x0130;

/// One such question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BroadcastRead {
    index: u8,
}

impl BroadcastRead {
    /// A question with this index, by which its answer is known.
    pub fn new(index: u8) -> Self {
        Self { index }
    }

    /// Its bytes.
    pub fn frame(self) -> [u8; FRAME] {
        let mut frame = [0; FRAME];
        let mut put = |at: usize, bytes: &[u8]| {
            frame.iter_mut().skip(at).zip(bytes).for_each(|(place, byte)| *place = *byte);
        };
        put(0, &[0xFF; 6]);
        put(6, &[0x10; 6]);
        put(12, &ETHERTYPE);
        // One datagram of 10 bytes, 2 of data, 2 of working counter.
        put(14, &(0x1000_u16 | 14).to_le_bytes());
        put(DATAGRAM, &[BROADCAST_READ, self.index]);
        put(DATAGRAM + 4, &AL_STATUS.to_le_bytes());
        put(DATAGRAM + 6, &2_u16.to_le_bytes());
        frame
    }

    /// How many devices read it, from the frame come back; `None` for any other frame, or one that went through no device.
    pub fn read(self, reply: &[u8]) -> Option<u16> {
        let head = reply.get(12..14)? == ETHERTYPE
            && reply.get(DATAGRAM..DATAGRAM + 2)? == [BROADCAST_READ, self.index];
        let processed = reply.get(6)? & 2 != 0;
        let counter = reply.get(DATAGRAM + 12..DATAGRAM + 14)?.first_chunk::<2>()?;
        (head && processed).then(|| u16::from_le_bytes(*counter))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn devices_are_counted_in_the_answer_alone() {
        let question = BroadcastRead::new(7);
        let mut frame = question.frame();
        assert_eq!(question.read(&frame), None, "our own");
        frame[6] |= 2;
        frame[28] = 3;
        assert_eq!(question.read(&frame), Some(3));
        assert_eq!(BroadcastRead::new(8).read(&frame), None, "another one's answer");
    }

    proptest! {
        #[test]
        fn any_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..80)) {
            let _ = BroadcastRead::new(0).read(&bytes);
        }
    }
}

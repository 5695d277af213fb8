//! CANopen over EtherCAT: the SDO server (ETG.1000.6, clause 5.6): expedited, normal and segmented, with aborts.

use crate::al::AlState;
use crate::dictionary::{Dictionary, abort};

const MAILBOX_HEADER: usize = 6;
const COE_HEADER: usize = 2;
/// Mailbox type of CoE.
const COE: u8 = 3;
const SDO_REQUEST: u8 = 2;
const SDO_RESPONSE: u8 = 3;

/// What the server remembers between segments.
#[derive(Debug, Default)]
pub(crate) struct SdoServer {
    transfer: Option<Transfer>,
    /// Downloads that were done: index, subindex.
    pub(crate) written: Vec<(u16, u8)>,
}

#[derive(Debug)]
struct Transfer {
    index: u16,
    sub: u8,
    data: Vec<u8>,
    toggle: bool,
    /// For a download: how many bytes are to come in all.
    expected: Option<usize>,
}

impl SdoServer {
    /// The answer to a mailbox message; `None` to anything but an SDO request.
    pub(crate) fn answer(
        &mut self,
        message: &[u8],
        room: usize,
        dictionary: &mut Dictionary,
        state: AlState,
    ) -> Option<Vec<u8>> {
        let length = usize::from(u16::from_le_bytes(*message.first_chunk::<2>()?));
        let kind = *message.get(5)?;
        let body = message.get(MAILBOX_HEADER..MAILBOX_HEADER + length)?;
        let service = body.get(1)? >> 4;
        if kind & 0x0F != COE || service != SDO_REQUEST {
            return None;
        }
        let request = body.get(COE_HEADER..)?;
        let address = (u16::from_le_bytes([*request.get(1)?, *request.get(2)?]), *request.get(3)?);
        let (service, answer) =
            match self.serve(request, room - MAILBOX_HEADER - COE_HEADER, dictionary, state) {
                Ok(answer) => (SDO_RESPONSE, answer),
                Err(code) => {
                    let (index, sub) = self.transfer.take().map_or(address, |open| (open.index, open.sub));
                    let mut answer = vec![0x80, index as u8, (index >> 8) as u8, sub];
                    answer.extend_from_slice(&code.to_le_bytes());
                    // An abort is a request of its own, whoever makes it.
                    (SDO_REQUEST, answer)
                }
            };
        Some(wrap(service, &answer, kind))
    }

    fn serve(
        &mut self,
        request: &[u8],
        room: usize,
        dictionary: &mut Dictionary,
        state: AlState,
    ) -> Result<Vec<u8>, u32> {
        let [command, low, high, sub] = *request.first_chunk::<4>().ok_or(abort::UNKNOWN_COMMAND)?;
        let index = u16::from_le_bytes([low, high]);
        match command >> 5 {
            0 => self.download_segment(command, request, dictionary, state),
            1 => self.download(command, index, sub, request, dictionary, state),
            2 => self.upload(index, sub, room, dictionary),
            3 => self.upload_segment(command, room),
            _ => Err(abort::UNKNOWN_COMMAND),
        }
    }

    fn upload(&mut self, index: u16, sub: u8, room: usize, dictionary: &Dictionary) -> Result<Vec<u8>, u32> {
        self.transfer = None;
        let data = dictionary.upload(index, sub)?;
        let mut answer = vec![0, index as u8, (index >> 8) as u8, sub];
        let size = data.len();
        if (1..=4).contains(&size) {
            answer.extend_from_slice(data);
            answer.resize(8, 0);
            set_command(&mut answer, 0x43 | ((4 - size as u8) << 2));
            return Ok(answer);
        }
        answer.extend_from_slice(&(size as u32).to_le_bytes());
        set_command(&mut answer, 0x41);
        let now = size.min(room - 8);
        answer.extend_from_slice(data.get(..now).unwrap_or(&[]));
        if now < size {
            let data = data.get(now..).unwrap_or(&[]).to_vec();
            self.transfer = Some(Transfer { index, sub, data, toggle: false, expected: None });
        }
        Ok(answer)
    }

    fn upload_segment(&mut self, command: u8, room: usize) -> Result<Vec<u8>, u32> {
        let open = self.transfer.as_mut().ok_or(abort::UNKNOWN_COMMAND)?;
        if (command & 0x10 != 0) != open.toggle {
            return Err(abort::TOGGLE);
        }
        let size = open.data.len().min(room - 1);
        let part: Vec<u8> = open.data.drain(..size).collect();
        let last = open.data.is_empty();
        let unused = 7_usize.saturating_sub(size);
        let mut answer = vec![u8::from(open.toggle) << 4 | (unused as u8) << 1 | u8::from(last)];
        answer.extend_from_slice(&part);
        answer.resize(answer.len() + unused, 0);
        open.toggle = !open.toggle;
        if last {
            self.transfer = None;
        }
        Ok(answer)
    }

    fn download(
        &mut self,
        command: u8,
        index: u16,
        sub: u8,
        request: &[u8],
        dictionary: &mut Dictionary,
        state: AlState,
    ) -> Result<Vec<u8>, u32> {
        self.transfer = None;
        let done = vec![0x60, index as u8, (index >> 8) as u8, sub, 0, 0, 0, 0];
        if command & 0x02 != 0 {
            // Expedited: as many bytes as it says, else as the object has.
            let own = dictionary.upload(index, sub)?.len();
            let size = if command & 0x01 != 0 { 4 - usize::from(command >> 2 & 3) } else { own };
            let data = request.get(4..4 + size).ok_or(abort::LENGTH)?;
            self.write(index, sub, data, dictionary, state)?;
            return Ok(done);
        }
        let size = request.get(4..8).and_then(|bytes| bytes.first_chunk::<4>()).ok_or(abort::LENGTH)?;
        let size = u32::from_le_bytes(*size) as usize;
        let data = request.get(8..).unwrap_or(&[]);
        if data.len() >= size {
            self.write(index, sub, data.get(..size).unwrap_or(&[]), dictionary, state)?;
        } else {
            self.transfer =
                Some(Transfer { index, sub, data: data.to_vec(), toggle: false, expected: Some(size) });
        }
        Ok(done)
    }

    fn download_segment(
        &mut self,
        command: u8,
        request: &[u8],
        dictionary: &mut Dictionary,
        state: AlState,
    ) -> Result<Vec<u8>, u32> {
        let open = self.transfer.as_mut().ok_or(abort::UNKNOWN_COMMAND)?;
        let expected = open.expected.ok_or(abort::UNKNOWN_COMMAND)?;
        if (command & 0x10 != 0) != open.toggle {
            return Err(abort::TOGGLE);
        }
        let unused = if request.len() <= 8 { usize::from(command >> 1 & 7) } else { 0 };
        let data = request.get(1..request.len() - unused).ok_or(abort::LENGTH)?;
        open.data.extend_from_slice(data);
        let answer = vec![0x20 | u8::from(open.toggle) << 4, 0, 0, 0, 0, 0, 0, 0];
        open.toggle = !open.toggle;
        if command & 1 != 0 {
            let open = self.transfer.take().ok_or(abort::UNKNOWN_COMMAND)?;
            if open.data.len() != expected {
                return Err(abort::LENGTH);
            }
            self.write(open.index, open.sub, &open.data, dictionary, state)?;
        }
        Ok(answer)
    }

    fn write(
        &mut self,
        index: u16,
        sub: u8,
        data: &[u8],
        dictionary: &mut Dictionary,
        state: AlState,
    ) -> Result<(), u32> {
        if is_mapping(index) && sub > 0 {
            let mut bytes = [0; 4];
            bytes.iter_mut().zip(data).for_each(|(place, byte)| *place = *byte);
            let entry = u32::from_le_bytes(bytes);
            if !dictionary.mappable((entry >> 16) as u16, (entry >> 8) as u8, entry as u8) {
                return Err(abort::NOT_MAPPABLE);
            }
        }
        dictionary.download(index, sub, data, state)?;
        self.written.push((index, sub));
        Ok(())
    }
}

fn is_mapping(index: u16) -> bool {
    (0x1600..0x1C00).contains(&index)
}

fn set_command(answer: &mut [u8], command: u8) {
    if let Some(first) = answer.first_mut() {
        *first = command;
    }
}

/// Puts the headers in front; the counter of the request comes back.
fn wrap(service: u8, answer: &[u8], kind: u8) -> Vec<u8> {
    let mut message = ((answer.len() + COE_HEADER) as u16).to_le_bytes().to_vec();
    message.extend_from_slice(&[0, 0, 0, kind & 0xF0 | COE, 0, service << 4]);
    message.extend_from_slice(answer);
    message
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dictionary::Access;
    use proptest::prelude::*;

    fn request(body: &[u8]) -> Vec<u8> {
        let mut message = ((body.len() + 2) as u16).to_le_bytes().to_vec();
        message.extend_from_slice(&[0, 0, 0, 0x13, 0, SDO_REQUEST << 4]);
        message.extend_from_slice(body);
        message.resize(64, 0);
        message
    }

    fn dictionary() -> Dictionary {
        let mut dictionary = Dictionary::default();
        dictionary.add(0x1008, 0, Access::ReadOnly, [b'x'; 100]);
        dictionary.add(0x2000, 0, Access::Always, [0; 4]);
        dictionary.add(0x2001, 0, Access::Always, [0; 20]);
        dictionary
    }

    #[test]
    fn a_long_object_comes_in_segments() {
        let (mut server, mut dictionary) = (SdoServer::default(), dictionary());
        let mut ask =
            |body: &[u8]| server.answer(&request(body), 64, &mut dictionary, AlState::PreOp).unwrap();
        let first = ask(&[0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
        let mut data = first[16..].to_vec();
        let mut toggle = 0;
        loop {
            let segment = ask(&[0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
            data.extend_from_slice(&segment[9..]);
            toggle ^= 0x10;
            if segment[8] & 1 != 0 {
                break;
            }
        }
        assert_eq!(data, [b'x'; 100]);
    }

    #[test]
    fn a_download_in_segments_arrives_whole() {
        let (mut server, mut dictionary) = (SdoServer::default(), dictionary());
        let mut ask =
            |body: &[u8]| server.answer(&request(body), 64, &mut dictionary, AlState::PreOp).unwrap();
        ask(&[0x21, 0x01, 0x20, 0, 20, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8]);
        ask(&[0x00, 9, 10, 11, 12, 13, 14, 15]);
        let last = ask(&[0x10 | 2 << 1 | 1, 16, 17, 18, 19, 20, 0, 0]);
        assert_eq!(last[8], 0x30);
        assert_eq!(dictionary.upload(0x2001, 0).unwrap(), (1..=20).collect::<Vec<u8>>());
    }

    proptest! {
        /// No message makes it fall over, and what is answered fits the mailbox.
        #[test]
        fn any_message_is_survived(messages in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..80), 1..8)) {
            let (mut server, mut dictionary) = (SdoServer::default(), dictionary());
            for message in messages {
                if let Some(answer) = server.answer(&message, 64, &mut dictionary, AlState::PreOp) {
                    prop_assert!(answer.len() <= 64);
                }
            }
        }
    }
}

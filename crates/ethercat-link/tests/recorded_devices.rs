//! Devices of Beckhoff's as they were recorded: `scan` reads their SII and mailboxes from the captures that ethercrab's sources
//! carry for its own tests (MIT or Apache-2.0). They are read where cargo keeps them; nothing of them is copied.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)]

use cargo_metadata::MetadataCommand;
use ethercat_link::{Link, LinkError, scan};
use fieldbus::BroadcastRead;
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::process::Command;

/// Ethernet and EtherCAT headers, the header of a datagram, its working counter.
const HEADERS: usize = 16;
const DATAGRAM: usize = 10;
const COUNTER: usize = 2;
/// Bit 1 of the source address's first byte: the frame went through a device.
const PROCESSED: u8 = 2;

fn capture(name: &str) -> Vec<u8> {
    // Of this platform alone: what others need was never downloaded on a new machine.
    let rustc = String::from_utf8(Command::new("rustc").arg("-vV").output().unwrap().stdout).unwrap();
    let host = rustc.lines().find_map(|line| line.strip_prefix("host: ")).unwrap().to_owned();
    let metadata =
        MetadataCommand::new().other_options(["--filter-platform".to_owned(), host]).exec().unwrap();
    let ethercrab = metadata.packages.iter().find(|package| package.name.as_str() == "ethercrab").unwrap();
    let folder = PathBuf::from(&ethercrab.manifest_path).parent().unwrap().to_owned();
    std::fs::read(folder.join("tests").join(name)).unwrap()
}

/// The frames of a pcapng file.
fn frames(mut file: &[u8]) -> Vec<Vec<u8>> {
    const PACKET: u32 = 6;
    let word = |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let mut all = Vec::new();
    while file.len() >= 12 {
        let (kind, length) = (word(file, 0), word(file, 4) as usize);
        if kind == PACKET {
            let captured = word(file, 20) as usize;
            all.push(file[28..28 + captured].to_vec());
        }
        file = &file[length..];
    }
    all
}

/// A datagram: where it begins, and its bytes with the working counter.
fn datagrams(frame: &[u8]) -> Vec<(usize, Vec<u8>)> {
    let mut all = Vec::new();
    let mut at = HEADERS;
    loop {
        let length = u16::from_le_bytes([frame[at + 6], frame[at + 7]]);
        let size = DATAGRAM + usize::from(length & 0x7FF) + COUNTER;
        all.push((at, frame[at..at + size].to_vec()));
        if length & 0x8000 == 0 {
            return all;
        }
        at += size;
    }
}

/// What a datagram asks: command, addresses, length; and what it writes, where it is a write.
type Question = (u8, [u8; 4], u16, Vec<u8>);

fn question(datagram: &[u8]) -> Question {
    let writes = matches!(datagram[0], 2 | 5 | 8);
    let length = u16::from_le_bytes([datagram[6], datagram[7]]) & 0x7FF;
    let data = if writes { datagram[DATAGRAM..datagram.len() - COUNTER].to_vec() } else { Vec::new() };
    (datagram[0], datagram[2..6].try_into().unwrap(), length, data)
}

/// Answers each question as the devices did: in the order in which it was asked then, and the last answer again after that.
struct Recorded {
    answers: BTreeMap<Question, VecDeque<Vec<u8>>>,
    replies: VecDeque<Vec<u8>>,
    now_ns: u64,
    unknown: Vec<Question>,
}

impl Recorded {
    fn new(name: &str) -> Self {
        let mut asked: BTreeMap<u8, Vec<u8>> = BTreeMap::new();
        let mut answers: BTreeMap<Question, VecDeque<Vec<u8>>> = BTreeMap::new();
        for frame in frames(&capture(name)) {
            let index = frame[HEADERS + 1];
            if frame[6] & PROCESSED == 0 {
                asked.insert(index, frame);
                continue;
            }
            let Some(sent) = asked.remove(&index) else { continue };
            for ((_, asked), (_, answer)) in datagrams(&sent).iter().zip(datagrams(&frame)) {
                answers.entry(question(asked)).or_default().push_back(answer);
            }
        }
        Self { answers, replies: VecDeque::new(), now_ns: 1, unknown: Vec::new() }
    }
}

impl Link for Recorded {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), LinkError> {
        let mut reply = frame.to_vec();
        reply[6] |= PROCESSED;
        for (at, datagram) in datagrams(frame) {
            let asked = question(&datagram);
            let Some(answers) = self.answers.get_mut(&asked) else {
                self.unknown.push(asked);
                continue;
            };
            let answer = if answers.len() > 1 { answers.pop_front().unwrap() } else { answers[0].clone() };
            // The address as it left the devices, the data and the working counter; the index is the question's.
            reply[at + 2..at + 4].copy_from_slice(&answer[2..4]);
            reply[at + DATAGRAM..at + datagram.len()].copy_from_slice(&answer[DATAGRAM..]);
        }
        self.now_ns += 10_000;
        self.replies.push_back(reply);
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], until_ns: u64) -> Result<Option<usize>, LinkError> {
        let Some(reply) = self.replies.pop_front() else {
            self.now_ns = self.now_ns.max(until_ns);
            return Ok(None);
        };
        buffer[..reply.len()].copy_from_slice(&reply);
        self.now_ns += 10_000;
        Ok(Some(reply.len()))
    }
}

/// Vendor 2 is Beckhoff, whose product codes hold the number of the terminal in their upper half.
#[test]
fn recorded_couplers_and_terminals_are_read() {
    let rows: [(&str, &[(&str, u32)]); 3] = [
        ("replay-ek1100-el2828-el2889.pcapng", &[("EK1100", 1100), ("EL2828", 2828), ("EL2889", 2889)]),
        ("replay-ek1100-alias-address.pcapng", &[]),
        ("replay-ek1914-segmented-upload.pcapng", &[]),
    ];
    for (name, expected) in rows {
        let mut link = Recorded::new(name);
        let found = scan(&mut link).unwrap_or_else(|error| panic!("{name}: {error}; {:?}", link.unknown));
        for device in &found {
            println!("{name}: {device:?}");
            assert_eq!(device.vendor, 2, "{name}: {device:?}");
        }
        let names: Vec<(&str, u32)> =
            found.iter().map(|device| (&*device.name, device.product >> 16)).collect();
        assert!(expected.is_empty() || names == expected, "{name}: {names:?}");
    }
}

/// Frames that a main device sent and devices answered, walked by the simulated device's and our own reader of broadcasts.
#[test]
fn every_recorded_frame_is_walked_to_its_end() {
    for name in
        ["replay-dc.pcapng", "replay-ek1100-el2828-el2889.pcapng", "replay-ek1914-el3004-mailbox.pcapng"]
    {
        let all = frames(&capture(name));
        assert!(all.len() > 500, "{name}");
        let mut counted = 0;
        for frame in &all {
            let (at, last) = datagrams(frame).pop().unwrap();
            let end = HEADERS + usize::from(u16::from_le_bytes([frame[14], frame[15]]) & 0x7FF);
            assert_eq!(at + last.len(), end, "{name}: the header's length is that of the datagrams");
            counted += usize::from(BroadcastRead::new(frame[HEADERS + 1]).read(frame).is_some());
        }
        println!("{name}: {} frames, {counted} answers to broadcasts", all.len());
        assert!(counted > 0, "{name}: a bring-up counts its devices");
    }
}

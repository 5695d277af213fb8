//! How long a frame takes to the devices and back: broadcast reads of the AL status, which change nothing.

use crate::link::Link;
use fieldbus::BroadcastRead;

/// Frames that are sent, and how long each is waited for, ns.
const FRAMES: usize = 200;
const WAIT_NS: u64 = 5_000_000;
/// No more frames than this wait in a socket.
const MOST_WAITING: usize = 1000;

/// What came back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Probe {
    /// Frames sent.
    pub sent: usize,
    /// Frames that came back, read by a device.
    pub answered: usize,
    /// Devices that read the last one.
    pub devices: u16,
    /// Median of the round trips, ns.
    pub median_ns: u64,
    /// The longest, ns.
    pub longest_ns: u64,
}

/// Sends some frames, one after the other.
pub fn probe(link: &mut impl Link) -> Probe {
    let mut trips_ns = Vec::with_capacity(FRAMES);
    let mut found = Probe { sent: FRAMES, ..Probe::default() };
    for number in 0..FRAMES {
        let sent_ns = link.now_ns();
        if let Some(devices) = ask(link, number as u8, sent_ns + WAIT_NS).filter(|devices| *devices > 0) {
            trips_ns.push(link.now_ns().saturating_sub(sent_ns));
            found.devices = devices;
        }
    }
    trips_ns.sort_unstable();
    found.answered = trips_ns.len();
    found.median_ns = trips_ns.get(trips_ns.len() / 2).copied().unwrap_or(0);
    found.longest_ns = trips_ns.last().copied().unwrap_or(0);
    found
}

/// Asks once who is there: how many devices read the question, from an answer until `until_ns`. Frames that came before are thrown away: an
/// old answer could be taken for this one's.
pub(crate) fn ask(link: &mut impl Link, index: u8, until_ns: u64) -> Option<u16> {
    let question = BroadcastRead::new(index);
    let mut buffer = [0; 1600];
    for _ in 0..MOST_WAITING {
        let now_ns = link.now_ns();
        if !matches!(link.receive(&mut buffer, now_ns), Ok(Some(_))) {
            break;
        }
    }
    link.send(&question.frame()).ok()?;
    while let Ok(Some(length)) = link.receive(&mut buffer, until_ns) {
        let reply = buffer.get(..length).unwrap_or(&[]);
        if let Some(devices) = question.read(reply) {
            return Some(devices);
        }
        if link.now_ns() >= until_ns {
            break;
        }
    }
    None
}

//! What carries frames: a network interface, or in tests a bus in memory.

use crate::error::LinkError;
use realtime::{PacketSocket, now_ns};

/// EtherType of EtherCAT.
const ETHERTYPE: u16 = 0x88A4;

/// Carries Ethernet frames to the devices and back. Its clock is the one that all times refer to.
pub trait Link {
    /// The present time, ns.
    fn now_ns(&self) -> u64;

    /// Sends a frame; never waits.
    ///
    /// # Errors
    /// Where the link takes none: it is down, or full.
    fn send(&mut self, frame: &[u8]) -> Result<(), LinkError>;

    /// The next frame that comes until `until_ns`: its length in `buffer`; `None` where none comes.
    ///
    /// # Errors
    /// Where the link is broken. It may come back, so a caller goes on at its own pace.
    fn receive(&mut self, buffer: &mut [u8], until_ns: u64) -> Result<Option<usize>, LinkError>;
}

/// A network interface.
#[derive(Debug)]
pub struct PacketLink {
    socket: PacketSocket,
}

impl PacketLink {
    /// Opens the interface.
    ///
    /// # Errors
    /// Where it is not there, or the process has no right to raw sockets.
    pub fn open(interface: &str) -> Result<Self, LinkError> {
        Ok(Self { socket: PacketSocket::open(interface, ETHERTYPE)? })
    }
}

impl Link for PacketLink {
    fn now_ns(&self) -> u64 {
        now_ns()
    }

    fn send(&mut self, frame: &[u8]) -> Result<(), LinkError> {
        let sent = self.socket.send(frame)?;
        if sent == frame.len() { Ok(()) } else { Err(LinkError::Cut { sent, expected: frame.len() }) }
    }

    fn receive(&mut self, buffer: &mut [u8], until_ns: u64) -> Result<Option<usize>, LinkError> {
        Ok(self.socket.receive(buffer, until_ns)?)
    }
}

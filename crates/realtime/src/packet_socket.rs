//! A raw Ethernet socket on one interface, for one EtherType: whole frames out and in, waiting no longer than until a time.

use crate::clock::now_ns;
use nix::errno::Errno;
use nix::libc;
use nix::net::if_::if_nametoindex;
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::sys::socket::{
    AddressFamily, LinkAddr, MsgFlags, SockFlag, SockType, SockaddrLike, bind, recv, send, socket,
};
use nix::sys::time::TimeSpec;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use thiserror::Error;

/// A socket that can't be had or doesn't work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum PacketError {
    /// No such interface.
    #[error("no such interface: {0}")]
    NoInterface(Errno),
    /// The kernel refuses a raw socket.
    #[error("raw socket: {0} (the process needs CAP_NET_RAW)")]
    Open(Errno),
    /// The interface does not take a frame: its link is down, or its queue full.
    #[error("send: {0}")]
    Send(Errno),
    /// The interface has gone.
    #[error("receive: {0}")]
    Receive(Errno),
}

/// A raw socket, closed when dropped.
#[derive(Debug)]
pub struct PacketSocket {
    descriptor: OwnedFd,
}

impl PacketSocket {
    /// Opens a socket on `interface` that receives frames of `ether_type` alone.
    ///
    /// # Errors
    /// [`PacketError::NoInterface`] and [`PacketError::Open`].
    pub fn open(interface: &str, ether_type: u16) -> Result<Self, PacketError> {
        Ok(Self { descriptor: open_raw(interface, ether_type)? })
    }

    /// Sends a whole frame; never waits.
    ///
    /// # Errors
    /// [`PacketError::Send`].
    pub fn send(&self, frame: &[u8]) -> Result<usize, PacketError> {
        send(self.descriptor.as_raw_fd(), frame, MsgFlags::MSG_DONTWAIT).map_err(PacketError::Send)
    }

    /// Waits for a frame until `until_ns` on CLOCK_MONOTONIC, and puts it into `buffer`: its length, `None` if none came.
    ///
    /// # Errors
    /// [`PacketError::Receive`].
    pub fn receive(&self, buffer: &mut [u8], until_ns: u64) -> Result<Option<usize>, PacketError> {
        let wait_ns = until_ns.saturating_sub(now_ns());
        let wait =
            TimeSpec::new((wait_ns / 1_000_000_000).cast_signed(), (wait_ns % 1_000_000_000).cast_signed());
        let mut waiting = [PollFd::new(self.descriptor.as_fd(), PollFlags::POLLIN)];
        match ppoll(&mut waiting, Some(wait), None) {
            Ok(0) | Err(Errno::EINTR) => return Ok(None),
            Ok(_) => {}
            Err(error) => return Err(PacketError::Receive(error)),
        }
        self.receive_now(buffer)
    }

    /// Puts a frame that has come into `buffer`: its length, `None` if none has.
    ///
    /// # Errors
    /// [`PacketError::Receive`].
    pub fn receive_now(&self, buffer: &mut [u8]) -> Result<Option<usize>, PacketError> {
        match recv(self.descriptor.as_raw_fd(), buffer, MsgFlags::MSG_DONTWAIT) {
            Ok(length) => Ok(Some(length)),
            Err(Errno::EAGAIN | Errno::EINTR) => Ok(None),
            Err(error) => Err(PacketError::Receive(error)),
        }
    }
}

impl AsFd for PacketSocket {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.descriptor.as_fd()
    }
}

/// A raw socket on `interface` for one protocol.
pub(crate) fn open_raw(interface: &str, protocol: u16) -> Result<OwnedFd, PacketError> {
    let index = if_nametoindex(interface).map_err(PacketError::NoInterface)?;
    let flags = SockFlag::SOCK_CLOEXEC | SockFlag::SOCK_NONBLOCK;
    // Without a protocol it receives nothing until it is bound.
    let descriptor = socket(AddressFamily::Packet, SockType::Raw, flags, None).map_err(PacketError::Open)?;
    let address = link_address(index, protocol).ok_or(PacketError::Open(Errno::EINVAL))?;
    bind(descriptor.as_raw_fd(), &address).map_err(PacketError::Open)?;
    Ok(descriptor)
}

fn link_address(index: libc::c_uint, ether_type: u16) -> Option<LinkAddr> {
    let address = libc::sockaddr_ll {
        sll_family: libc::AF_PACKET as libc::c_ushort,
        sll_protocol: ether_type.to_be(),
        sll_ifindex: libc::c_int::try_from(index).ok()?,
        sll_hatype: 0,
        sll_pkttype: 0,
        sll_halen: 0,
        sll_addr: [0; 8],
    };
    let size = libc::socklen_t::try_from(size_of_val(&address)).ok()?;
    // SAFETY: the pointer is to a whole `sockaddr_ll` of the family AF_PACKET, of the size that is said, and is only read
    // during the call.
    unsafe { LinkAddr::from_raw((&raw const address).cast(), Some(size)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interface_that_is_not_there_is_named_so() {
        let error = PacketSocket::open("no-such-link", 0x88A4).map(|_| ()).unwrap_err();
        assert_eq!(error, PacketError::NoInterface(Errno::ENODEV));
    }
}

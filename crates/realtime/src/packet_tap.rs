//! A tap on an interface: every frame that goes out or comes in, with the kernel's time of it. For a process beside the loop; it
//! waits, and its reads allocate.

use crate::packet_socket::{PacketError, open_raw};
use nix::cmsg_space;
use nix::errno::Errno;
use nix::libc;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::socket::{ControlMessageOwned, LinkAddr, MsgFlags, recvmsg, setsockopt, sockopt};
use nix::sys::time::TimeSpec;
use std::io::IoSliceMut;
use std::os::fd::{AsFd, AsRawFd, OwnedFd};

/// All protocols: sockets of one protocol alone don't see what goes out.
const ALL_PROTOCOLS: u16 = 0x0003;
/// Frames that may wait for the reader, bytes; the kernel grants what `net.core.rmem_max` allows.
const BUFFER_BYTES: usize = 8 << 20;

/// A frame as it passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TappedFrame<'a> {
    /// The frame.
    pub bytes: &'a [u8],
    /// When the kernel had it, ns since 1970.
    pub time_ns: u64,
    /// Whether this machine sent it.
    pub outgoing: bool,
}

/// A tap, closed when dropped.
#[derive(Debug)]
pub struct PacketTap {
    descriptor: OwnedFd,
}

impl PacketTap {
    /// Taps `interface` from now on.
    ///
    /// # Errors
    /// [`PacketError::NoInterface`] and [`PacketError::Open`].
    pub fn open(interface: &str) -> Result<Self, PacketError> {
        let descriptor = open_raw(interface, ALL_PROTOCOLS)?;
        setsockopt(&descriptor, sockopt::ReceiveTimestampns, &true).map_err(PacketError::Open)?;
        // A smaller buffer serves too.
        let _ = setsockopt(&descriptor, sockopt::RcvBuf, &BUFFER_BYTES);
        Ok(Self { descriptor })
    }

    /// The next frame, in `buffer`; `None` where none came for `wait_ms`.
    ///
    /// # Errors
    /// [`PacketError::Receive`].
    pub fn receive<'a>(
        &self,
        buffer: &'a mut [u8],
        wait_ms: u16,
    ) -> Result<Option<TappedFrame<'a>>, PacketError> {
        let mut waiting = [PollFd::new(self.descriptor.as_fd(), PollFlags::POLLIN)];
        match poll(&mut waiting, PollTimeout::from(wait_ms)) {
            Ok(0) | Err(Errno::EINTR) => return Ok(None),
            Ok(_) => {}
            Err(error) => return Err(PacketError::Receive(error)),
        }
        let mut control = cmsg_space!(TimeSpec);
        let mut parts = [IoSliceMut::new(buffer)];
        let descriptor = self.descriptor.as_raw_fd();
        let (length, time_ns, outgoing) =
            match recvmsg::<LinkAddr>(descriptor, &mut parts, Some(&mut control), MsgFlags::MSG_DONTWAIT) {
                Ok(message) => {
                    let outgoing =
                        message.address.is_some_and(|address| address.pkttype() == libc::PACKET_OUTGOING);
                    let messages = message.cmsgs().map_err(PacketError::Receive)?;
                    (message.bytes, messages.filter_map(time_of).next().unwrap_or(0), outgoing)
                }
                Err(Errno::EAGAIN | Errno::EINTR) => return Ok(None),
                Err(error) => return Err(PacketError::Receive(error)),
            };
        let bytes = buffer.get(..length).unwrap_or(&[]);
        Ok(Some(TappedFrame { bytes, time_ns, outgoing }))
    }
}

fn time_of(message: ControlMessageOwned) -> Option<u64> {
    let ControlMessageOwned::ScmTimestampns(time) = message else { return None };
    Some(time.tv_sec().unsigned_abs() * 1_000_000_000 + time.tv_nsec().unsigned_abs())
}

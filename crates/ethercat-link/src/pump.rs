//! ethercrab's futures, polled by hand: its frames are sent and received here, so that nothing waits longer than it may, and a late
//! or foreign frame ends nothing.

use crate::link::Link;
use core::future::Future;
use core::pin::Pin;
use core::task::{Context, Poll, Waker};
use ethercrab::{PduRx, PduTx};

/// The longest wait for one frame, ns: futures with timers are polled at least as often.
const SLICE_NS: u64 = 100_000;

/// Sends and receives ethercrab's frames.
pub struct Pump {
    tx: PduTx<'static>,
    rx: PduRx<'static>,
    buffer: [u8; 1600],
}

impl core::fmt::Debug for Pump {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Pump")
    }
}

impl Pump {
    pub(crate) fn new(tx: PduTx<'static>, rx: PduRx<'static>) -> Self {
        Self { tx, rx, buffer: [0; 1600] }
    }

    /// Polls `future` until it is ready, or until `until_ns`; it may be gone on with later.
    pub fn poll_until<F: Future + ?Sized>(
        &mut self,
        mut future: Pin<&mut F>,
        link: &mut impl Link,
        until_ns: u64,
    ) -> Poll<F::Output> {
        let mut context = Context::from_waker(Waker::noop());
        loop {
            let now_ns = link.now_ns();
            realtime::tell_time(now_ns);
            if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
                return Poll::Ready(output);
            }
            self.send(link);
            if now_ns >= until_ns {
                return Poll::Pending;
            }
            let wait_until = until_ns.min(now_ns + SLICE_NS);
            match link.receive(&mut self.buffer, wait_until) {
                // A frame that ethercrab does not know any more is late: it has been counted lost.
                Ok(Some(length)) => _ = self.rx.receive_frame(self.buffer.get(..length).unwrap_or(&[])),
                Ok(None) => {}
                // The link is broken: the future's own timeouts say so.
                Err(_) if link.now_ns() < wait_until => return Poll::Pending,
                Err(_) => {}
            }
        }
    }

    /// Sends what is waiting. A frame that is not taken stays waiting, so the first refusal ends it.
    fn send(&mut self, link: &mut impl Link) {
        while let Some(frame) = self.tx.next_sendable_frame() {
            let sent = frame.send_blocking(|bytes| {
                link.send(bytes).map(|()| bytes.len()).map_err(|_| ethercrab::error::Error::SendFrame)
            });
            if sent.is_err() {
                return;
            }
        }
    }
}

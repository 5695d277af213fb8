//! One cycle on the wire: the frame out, its reply until its time, everything else counted and thrown away.

use crate::link::Link;
use fieldbus::{CyclicFrame, FrameError, Inputs, Layout, MAX_FRAME, Outputs};

/// What came back of a cycle's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Back {
    /// A reply, with what it says.
    Reply {
        /// When the frame went out, on the link's clock.
        sent_ns: u64,
        system_time_ns: u64,
        working_counter: u16,
        exchanged: bool,
        al_status: u16,
        al_code: u16,
        inputs: Option<Inputs>,
        round_trip_ns: u64,
    },
    /// None in time.
    Nothing,
    /// The frame did not go out.
    NotSent,
}

/// The wire of a device in SAFE-OP or OP.
#[derive(Debug, Clone)]
pub(crate) struct Wire {
    frame: CyclicFrame,
    layout: Layout,
    buffer: [u8; 1600],
    /// Replies that came after their cycle.
    pub(crate) late: u64,
}

impl Wire {
    /// `None` where the process data don't fit a frame.
    pub(crate) fn new(station: u16, layout: Layout) -> Option<Self> {
        const { assert!(MAX_FRAME <= 1600) };
        let (outputs, inputs) = layout.sizes();
        let frame = CyclicFrame::new(station, 0, inputs, outputs)?;
        Some(Self { frame, layout, buffer: [0; 1600], late: 0 })
    }

    /// Sends the outputs, and awaits the reply until `until_ns`.
    pub(crate) fn exchange(
        &mut self,
        link: &mut impl Link,
        outputs: &Outputs,
        al_request: Option<u16>,
        until_ns: u64,
    ) -> Back {
        let (bytes, size) = outputs.pack(self.layout);
        let frame = self.frame.build(bytes.get(..size).unwrap_or(&[]), al_request);
        let sent_ns = link.now_ns();
        if link.send(frame).is_err() {
            return Back::NotSent;
        }
        // An error of the link is no reply; it may come back.
        while let Ok(Some(length)) = link.receive(&mut self.buffer, until_ns) {
            match self.frame.read(self.buffer.get(..length).unwrap_or(&[])) {
                Ok(reply) => {
                    let exchanged = reply.exchanged();
                    return Back::Reply {
                        sent_ns,
                        system_time_ns: reply.system_time_ns,
                        working_counter: reply.working_counter,
                        exchanged,
                        al_status: reply.al_status,
                        al_code: reply.al_code,
                        inputs: Inputs::unpack(self.layout, reply.inputs).filter(|_| exchanged),
                        round_trip_ns: link.now_ns().saturating_sub(sent_ns),
                    };
                }
                Err(FrameError::Index { .. }) => self.late += 1,
                Err(_) => {}
            }
            if link.now_ns() >= until_ns {
                break;
            }
        }
        Back::Nothing
    }
}

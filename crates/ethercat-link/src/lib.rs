//! A drive on an EtherCAT cable: brought up through ethercrab, then exchanged with in one frame a cycle, and brought up again
//! after the bus was lost.
//!
//! ```text
//!  BringUp ──SAFE-OP──▶ Lock ──clock within 50 µs, 200 cycles──▶ Start ──OP──▶ Operate
//!    ▲                   │                                        │              │
//!  Seek ◀─ Wait ◀────────┴────────────────────────────────────────┴──────────────┘
//!  answers for 50 ms          no reply, refused: 0.5 s              bus lost, device left OP
//! ```
//! ethercrab does what happens once: addresses, SII, mailboxes, FMMUs. Its futures are polled by hand ([`Pump`]), its frames sent
//! by us: nothing waits but where we say, and there is no second thread. The frame of a cycle is our own
//! ([`fieldbus::CyclicFrame`]): it is built in place, and a late reply can't be mistaken for this cycle's.
#![forbid(unsafe_code)]

mod bridge;
mod bring_up;
mod error;
mod exchange;
mod link;
mod main_device;
mod params;
mod probe;
mod pump;
mod scan;

pub use bridge::Bridge;
pub use error::{BringUpError, LinkError, Step};
pub use link::{Link, PacketLink};
pub use main_device::Grid;
pub use params::{BridgeParams, WantedTooEarly};
pub use probe::{Probe, probe};
pub use pump::Pump;
pub use scan::{Found, scan};

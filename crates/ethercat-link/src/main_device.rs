//! ethercrab's main device, made once in a process and used for every bring-up, and the grid of our cycles.

use crate::pump::Pump;
use ethercrab::{MainDevice, MainDeviceConfig, PduStorage, RetryBehaviour, Timeouts};
use std::time::Duration;

/// Frames under way at once, and the bytes of each: a mailbox of 1 kB fits.
const FRAMES: usize = 8;
const FRAME_BYTES: usize = PduStorage::element_size(1100);

/// When our cycles begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// The beginning of one of them, on the link's clock, ns.
    pub origin_ns: u64,
    /// Their length, ns.
    pub period_ns: u32,
}

impl Grid {
    /// The first beginning of a cycle at or after `time_ns`.
    pub(crate) fn next(&self, time_ns: u64) -> u64 {
        let period = u64::from(self.period_ns.max(1));
        let since = time_ns.saturating_sub(self.origin_ns);
        self.origin_ns + since.div_ceil(period) * period
    }
}

/// A main device that lives as long as the process, and the pump for its frames. Its memory is never given back: one is made for
/// each cable, at the start.
pub(crate) fn make() -> (&'static MainDevice<'static>, Pump) {
    let storage: &'static PduStorage<FRAMES, FRAME_BYTES> = Box::leak(Box::new(PduStorage::new()));
    let Ok((tx, rx, pdu_loop)) = storage.try_split() else {
        // It is split here for the first and only time.
        unreachable!("a fresh storage was split before")
    };
    let timeouts = Timeouts {
        pdu: Duration::from_millis(20),
        state_transition: Duration::from_secs(3),
        eeprom: Duration::from_millis(50),
        wait_loop_delay: Duration::ZERO,
        mailbox_echo: Duration::from_millis(200),
        mailbox_response: Duration::from_secs(1),
    };
    // Frames that are lost once are sent again; a clock that follows ours needs no thousands of frames to be set.
    let config = MainDeviceConfig { dc_static_sync_iterations: 0, retry_behaviour: RetryBehaviour::Count(3) };
    let main = Box::leak(Box::new(MainDevice::new(pdu_loop, timeouts, config)));
    (main, Pump::new(tx, rx))
}

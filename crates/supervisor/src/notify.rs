//! What systemd wants to hear of a service: that it is ready, that it is alive, that it ends. Nothing happens where no
//! systemd waits for it.

use sd_notify::{NotifyState, notify, watchdog_enabled};
use std::cell::Cell;
use std::time::{Duration, Instant};

/// Says that this process lives, as often as the service's WatchdogSec wants it and no oftener.
pub struct Pulse {
    interval: Option<Duration>,
    last: Cell<Option<Instant>>,
}

impl Pulse {
    /// Looks whether systemd watches this process.
    pub fn new() -> Self {
        // A quarter of what systemd allows: one that gets lost, or comes late, does no harm.
        Self { interval: watchdog_enabled().map(|allowed| allowed / 4), last: Cell::new(None) }
    }

    /// The supervisor looks around.
    pub fn beat(&self) {
        let Some(interval) = self.interval else { return };
        if self.last.get().is_none_or(|last| last.elapsed() >= interval) {
            self.last.set(Some(Instant::now()));
            send(&[NotifyState::Watchdog]);
        }
    }
}

/// All processes of a generation run.
pub fn ready(generation: u64) {
    let status = format!("generation {generation} began, disarmed; stepvalve status says more");
    send(&[NotifyState::Ready, NotifyState::Status(&status)]);
}

/// The valve is being stopped for good.
pub fn stopping() {
    send(&[NotifyState::Stopping]);
}

/// A message that gets lost is followed by the next, or by systemd's own limits.
fn send(state: &[NotifyState]) {
    let _ = notify(state);
}

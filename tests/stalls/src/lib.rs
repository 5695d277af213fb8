//! When the machine stood still: a thread on each core, above every other, notes when it woke late.

use realtime::{Wanted, now_ns, obtain};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::Duration;

/// Above the loop and the drive.
const PRIORITY: u8 = 95;

/// A time in which a core did not run its witness, ns of CLOCK_MONOTONIC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stall {
    /// The core.
    pub core: usize,
    /// Whether the witness was above every other thread: else one of them may have kept it from running.
    pub above_all: bool,
    /// When it was to wake.
    pub from_ns: u64,
    /// When it woke.
    pub to_ns: u64,
}

impl Stall {
    /// How long it was, ns.
    #[must_use]
    pub fn length_ns(&self) -> u64 {
        self.to_ns.saturating_sub(self.from_ns)
    }

    /// How much of it lies between two moments, ns.
    #[must_use]
    pub fn within_ns(&self, from_ns: u64, to_ns: u64) -> u64 {
        self.to_ns.min(to_ns).saturating_sub(self.from_ns.max(from_ns))
    }
}

/// Watches all cores, until it is dropped.
#[derive(Debug)]
pub struct Stalls {
    seen: Arc<Mutex<Vec<Stall>>>,
    over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Stalls {
    /// Each witness sleeps for `nap` at a time; what begins and ends within one is not seen. Waking later by `late` is a stall.
    #[must_use]
    pub fn watch(nap: Duration, late: Duration) -> Self {
        let (seen, over) = (Arc::default(), Arc::<AtomicBool>::default());
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = (0..cores).map(|core| {
            let (seen, over) = (Arc::clone(&seen), Arc::clone(&over));
            spawn(move || witness(core, (nap, late), &over, &seen))
        });
        Self { threads: threads.collect(), seen, over }
    }

    /// Those seen so far, of each core in their order.
    #[must_use]
    pub fn seen(&self) -> Vec<Stall> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for Stalls {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

fn witness(core: usize, (nap, late): (Duration, Duration), over: &AtomicBool, seen: &Mutex<Vec<Stall>>) {
    let (obtained, _awake) =
        obtain(&Wanted { core: Some(core), priority: Some(PRIORITY), lock_memory: false });
    let above_all = obtained.priority.is_some() && obtained.core.is_some();
    while !over.load(Ordering::Relaxed) {
        let from_ns = now_ns() + nanoseconds(nap);
        sleep(nap);
        let to_ns = now_ns();
        if to_ns > from_ns + nanoseconds(late) {
            let stall = Stall { core, above_all, from_ns, to_ns };
            seen.lock().unwrap_or_else(PoisonError::into_inner).push(stall);
        }
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_within_a_time_is_counted() {
        let stall = Stall { core: 0, above_all: true, from_ns: 100, to_ns: 130 };
        let cases = [
            ((0, 200), 30),
            ((110, 200), 20),
            ((0, 110), 10),
            ((105, 115), 10),
            ((0, 100), 0),
            ((130, 200), 0),
        ];
        for ((from_ns, to_ns), expected) in cases {
            assert_eq!(stall.within_ns(from_ns, to_ns), expected, "{from_ns} to {to_ns}");
        }
    }

    /// No machine sleeps for exactly as long as it was told to.
    #[test]
    fn every_core_has_a_witness() {
        let stalls = Stalls::watch(Duration::from_micros(200), Duration::ZERO);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        while (0..cores).any(|core| stalls.seen().iter().all(|stall| stall.core != core)) {
            sleep(Duration::from_millis(1));
        }
        assert!(stalls.seen().iter().all(|stall| stall.length_ns() > 0));
    }
}

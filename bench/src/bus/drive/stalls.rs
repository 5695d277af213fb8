//! When the machine stood still: a thread on each core, above every other, notes when it woke late.

use realtime::{Wanted, now_ns, obtain};
use std::ops::RangeInclusive;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, sleep, spawn};
use std::time::Duration;

/// Above the loop and the drive.
const PRIORITY: u8 = 95;
const NAP: Duration = Duration::from_millis(1);
/// Later than this is a stall, ns: a frame on its way may be late by as much.
const LATE_NS: u64 = 200_000;
/// What a stall may still disturb before and after, ns: two cycles.
const AROUND_NS: u64 = 2_000_000;

/// The watch.
pub(super) struct Stalls {
    over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<Vec<RangeInclusive<u64>>>>,
}

impl Stalls {
    /// Watches from now on.
    pub(super) fn watch() -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = (0..cores).map(|core| {
            let over = Arc::clone(&over);
            spawn(move || watch(core, &over))
        });
        Self { threads: threads.collect(), over }
    }

    /// The times in which the machine stood still, or what followed could be a consequence, ns.
    pub(super) fn end(self) -> Vec<RangeInclusive<u64>> {
        self.over.store(true, Ordering::Relaxed);
        self.threads.into_iter().filter_map(|thread| thread.join().ok()).flatten().collect()
    }
}

fn watch(core: usize, over: &AtomicBool) -> Vec<RangeInclusive<u64>> {
    let _awake = obtain(&Wanted { core: Some(core), priority: Some(PRIORITY), lock_memory: false });
    let mut stalls = Vec::new();
    while !over.load(Ordering::Relaxed) {
        let due_ns = now_ns() + NAP.as_nanos() as u64;
        sleep(NAP);
        let woke_ns = now_ns();
        if woke_ns > due_ns + LATE_NS {
            stalls.push(due_ns - AROUND_NS..=woke_ns + AROUND_NS);
        }
    }
    stalls
}

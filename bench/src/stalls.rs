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

/// Times in which a core stood still, ns.
pub type Times = Vec<RangeInclusive<u64>>;

/// The watch.
pub struct Stalls {
    over: Arc<AtomicBool>,
    threads: Vec<JoinHandle<Times>>,
}

impl Stalls {
    /// Watches from now on.
    pub fn watch() -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = (0..cores).map(|core| {
            let over = Arc::clone(&over);
            spawn(move || watch(core, &over))
        });
        Self { threads: threads.collect(), over }
    }

    /// The times in which one of the cores stood still.
    pub fn end(self) -> Times {
        self.over.store(true, Ordering::Relaxed);
        self.threads.into_iter().filter_map(|thread| thread.join().ok()).flatten().collect()
    }
}

fn watch(core: usize, over: &AtomicBool) -> Times {
    let _awake = obtain(&Wanted { core: Some(core), priority: Some(PRIORITY), lock_memory: false });
    let mut stalls = Vec::new();
    while !over.load(Ordering::Relaxed) {
        let due_ns = now_ns() + NAP.as_nanos() as u64;
        sleep(NAP);
        let woke_ns = now_ns();
        if woke_ns > due_ns + LATE_NS {
            stalls.push(due_ns..=woke_ns);
        }
    }
    stalls
}

/// For how long the machine stood still between two times at the most, ns: stalls of several cores are added.
pub fn within(stalls: &Times, from_ns: u64, until_ns: u64) -> u64 {
    let part = |stall: &RangeInclusive<u64>| {
        (*stall.end()).min(until_ns).saturating_sub((*stall.start()).max(from_ns))
    };
    stalls.iter().map(part).sum()
}

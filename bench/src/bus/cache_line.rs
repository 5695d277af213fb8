//! Two counters, each in cache lines of its own, between two threads: no message can be faster.

use super::stay_on;
use crate::timing::Times;
use anyhow::{Result, anyhow};
use realtime::now_ns;
use std::sync::atomic::{AtomicU64, Ordering};

/// A counter that shares no cache line, nor the line fetched beside it, with anything.
#[repr(align(128))]
#[derive(Default)]
struct Counter(AtomicU64);

pub(super) fn run(trips: u64, times: &mut Times) -> Result<()> {
    let (there, back) = (Counter::default(), Counter::default());
    let ready = Counter::default();
    std::thread::scope(|scope| {
        let echo = scope.spawn(|| -> Result<()> {
            let pinned = stay_on(1);
            ready.0.store(1, Ordering::Release);
            for trip in 1..=trips {
                wait_for(&there, trip);
                back.0.store(trip, Ordering::Release);
            }
            pinned
        });
        wait_for(&ready, 1);
        for trip in 1..=trips {
            let begun = now_ns();
            there.0.store(trip, Ordering::Release);
            wait_for(&back, trip);
            times.add(now_ns() - begun);
        }
        echo.join().map_err(|_| anyhow!("the other thread died"))?
    })
}

fn wait_for(counter: &Counter, value: u64) {
    while counter.0.load(Ordering::Acquire) != value {
        std::hint::spin_loop();
    }
}

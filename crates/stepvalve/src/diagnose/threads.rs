//! As many threads as there are processors.

use diagnosis::Workers;
use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Shares jobs among threads.
pub struct Threads {
    count: usize,
}

impl Threads {
    /// One for each processor.
    pub fn new() -> Self {
        Self { count: std::thread::available_parallelism().map_or(1, NonZero::get) }
    }
}

impl Workers for Threads {
    fn run(&self, count: usize, job: &(dyn Fn(usize) + Sync)) {
        let next = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..self.count.min(count) {
                scope.spawn(|| {
                    loop {
                        let index = next.fetch_add(1, Ordering::Relaxed);
                        if index >= count {
                            break;
                        }
                        job(index);
                    }
                });
            }
        });
    }
}

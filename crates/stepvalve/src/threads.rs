//! As many threads as there are processors, for as long as the user gives them.

use diagnosis::Workers;
use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Shares jobs among threads.
pub struct Threads {
    count: usize,
    until: Option<Instant>,
}

impl Threads {
    /// One for each processor, for so long.
    pub fn new(limit: Option<Duration>) -> Self {
        let count = std::thread::available_parallelism().map_or(1, NonZero::get);
        Self { count, until: limit.map(|limit| Instant::now() + limit) }
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

    fn is_over(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() >= until)
    }
}

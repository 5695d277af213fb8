//! As many threads as there are processors, for as long as the user gives them.

use diagnosis::Workers;
use std::num::NonZero;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Shares jobs among threads.
#[derive(Debug, Clone)]
pub struct Threads {
    count: usize,
    until: Option<Instant>,
    stop: Arc<AtomicBool>,
}

impl Threads {
    /// One for each processor, for so long.
    pub fn new(limit: Option<Duration>) -> Self {
        let count = std::thread::available_parallelism().map_or(1, NonZero::get);
        Self { count, until: limit.map(|limit| Instant::now() + limit), stop: Arc::default() }
    }

    /// The same, so many.
    #[must_use]
    pub fn so_many(self, count: NonZero<usize>) -> Self {
        Self { count: count.get(), ..self }
    }

    /// The same, ended sooner by whoever sets this.
    #[must_use]
    pub fn stopped_by(self, stop: &Arc<AtomicBool>) -> Self {
        Self { stop: Arc::clone(stop), ..self }
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
        self.stop.load(Ordering::Relaxed) || self.until.is_some_and(|until| Instant::now() >= until)
    }
}

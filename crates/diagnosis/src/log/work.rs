//! The number of samples simulated. It bounds a diagnosis, whatever the log contains and whatever machine it runs on.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Counter of the simulated samples, and their limit.
#[derive(Debug, Default)]
pub(crate) struct Work {
    samples: AtomicU64,
    allowed: AtomicU64,
    /// True if something was left out because the limit was reached.
    was_cut: AtomicBool,
}

impl Work {
    /// Adds simulated samples.
    pub fn add(&self, samples: usize) {
        self.samples.fetch_add(samples as u64, Ordering::Relaxed);
    }

    /// Samples simulated so far.
    pub fn simulated(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }

    /// Sets the limit of the samples simulated in all.
    pub fn allow(&self, samples: u64) {
        self.allowed.store(samples, Ordering::Relaxed);
    }

    /// Does what a conclusion can't do without: if the limit is reached, or close, so many samples more may be simulated meanwhile.
    pub fn with_reserve<T>(&self, samples: u64, needed: impl FnOnce() -> T) -> T {
        let limit = self.allowed.load(Ordering::Relaxed);
        self.allow(limit.max(self.simulated().saturating_add(samples)));
        let done = needed();
        self.allow(limit);
        done
    }

    /// True if more than the limit was simulated; the caller then leaves out the rest, which is noted.
    pub fn is_spent(&self) -> bool {
        let spent = self.simulated() > self.allowed.load(Ordering::Relaxed);
        if spent {
            self.was_cut.store(true, Ordering::Relaxed);
        }
        spent
    }

    /// Whether anything was left out so far.
    pub fn was_cut(&self) -> bool {
        self.was_cut.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_work_may_be_allowed_and_what_was_left_out_is_remembered() {
        let work = Work::default();
        work.allow(10);
        work.add(10);
        assert!(!work.is_spent() && !work.was_cut());
        work.add(1);
        assert!(work.is_spent());
        work.allow(20);
        assert!(!work.is_spent() && work.was_cut());
    }

    #[test]
    fn the_reserve_is_there_for_what_is_needed_alone() {
        let work = Work::default();
        work.allow(10);
        work.add(15);
        assert!(work.is_spent());
        assert!(!work.with_reserve(5, || work.is_spent()));
        work.with_reserve(5, || work.add(6));
        assert!(work.is_spent());
    }
}

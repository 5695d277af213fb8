//! How much has been simulated: what bounds a diagnosis, whatever is in the log, and whatever machine it runs on.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// A counter that predictions add to, and what it may come to.
#[derive(Debug, Default)]
pub(crate) struct Work {
    samples: AtomicU64,
    allowed: AtomicU64,
    /// Something was left out for it.
    was_cut: AtomicBool,
}

impl Work {
    /// So many samples were simulated.
    pub fn add(&self, samples: usize) {
        self.samples.fetch_add(samples as u64, Ordering::Relaxed);
    }

    /// How many were.
    pub fn simulated(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }

    /// So many may be simulated from now on.
    pub fn allow(&self, samples: u64) {
        self.allowed.store(samples, Ordering::Relaxed);
    }

    /// Whether as many were simulated as may be: whoever asks leaves out the rest.
    pub fn is_spent(&self) -> bool {
        let spent = self.simulated() > self.allowed.load(Ordering::Relaxed);
        if spent {
            self.was_cut.store(true, Ordering::Relaxed);
        }
        spent
    }

    /// Whether anything was left out, then or now.
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
}

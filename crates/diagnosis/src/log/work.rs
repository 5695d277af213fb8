//! How much has been simulated: what bounds a diagnosis, whatever is in the log, and whatever machine it runs on.

use std::sync::atomic::{AtomicU64, Ordering};

/// A counter that predictions add to.
#[derive(Debug, Default)]
pub(crate) struct Work {
    samples: AtomicU64,
}

impl Work {
    /// So many samples were simulated.
    pub fn add(&self, samples: usize) {
        self.samples.fetch_add(samples as u64, Ordering::Relaxed);
    }

    /// How many samples were simulated so far.
    pub fn samples(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }
}

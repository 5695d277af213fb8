//! Independent jobs; the caller decides how many threads do them.

use std::sync::OnceLock;

/// Does independent jobs, in any order, several at a time if it likes.
pub trait Workers: Sync {
    /// Calls `job` once with each number below `count`, and returns when all are done.
    fn run(&self, count: usize, job: &(dyn Fn(usize) + Sync));

    /// True if the caller's time is over: a diagnosis then concludes from the causes found so far.
    fn is_over(&self) -> bool {
        false
    }
}

/// One job after the other.
#[derive(Debug, Clone, Copy, Default)]
pub struct OneAfterTheOther;

impl Workers for OneAfterTheOther {
    fn run(&self, count: usize, job: &(dyn Fn(usize) + Sync)) {
        (0..count).for_each(job);
    }
}

/// The results of `job` for each number below `count`, in order: the same whatever the number of threads.
pub fn map<T: Send + Sync>(workers: &dyn Workers, count: usize, job: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let slots: Vec<OnceLock<T>> = (0..count).map(|_| OnceLock::new()).collect();
    workers.run(count, &|index| {
        if let Some(slot) = slots.get(index) {
            // Set once: each number is handed out once.
            let _ = slot.set(job(index));
        }
    });
    slots.into_iter().filter_map(OnceLock::into_inner).collect()
}

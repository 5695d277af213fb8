//! Memory that is there before the loop begins: locked, and with its stack touched; and the count of faults since.

use nix::sys::mman::{MlockAllFlags, mlockall};
use nix::sys::resource::{UsageWho, getrusage};
use serde::{Deserialize, Serialize};

/// Stack that is touched in advance, in bytes; a cycle uses a few kB.
const STACK_BYTES: usize = 256 * 1024;

/// Locks all memory of the process, present and future.
///
/// # Errors
/// What the kernel says, where the memlock limit is too low.
pub fn lock_memory() -> nix::Result<()> {
    mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE)
}

/// Touches the stack that the loop will use, so that it faults now and not there.
#[inline(never)]
pub fn prefault_stack() {
    std::hint::black_box(&mut [0_u8; STACK_BYTES]);
}

/// Page faults of a thread so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PageFaults {
    /// Served without the disk.
    pub minor: u64,
    /// Served from the disk.
    pub major: u64,
}

impl PageFaults {
    /// The faults since `earlier`.
    pub fn since(self, earlier: Self) -> Self {
        Self {
            minor: self.minor.saturating_sub(earlier.minor),
            major: self.major.saturating_sub(earlier.major),
        }
    }
}

/// Page faults of the calling thread so far; a system call, so not for the cycle.
pub fn page_faults_of_this_thread() -> PageFaults {
    getrusage(UsageWho::RUSAGE_THREAD).map_or_else(
        |_| PageFaults::default(),
        |usage| PageFaults {
            minor: usage.minor_page_faults().unsigned_abs(),
            major: usage.major_page_faults().unsigned_abs(),
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touching_new_memory_is_counted() {
        let before = page_faults_of_this_thread();
        let mut memory = vec![0_u8; 64 * 4096];
        memory.iter_mut().step_by(4096).for_each(|byte| *byte = 1);
        std::hint::black_box(&memory);
        assert!(page_faults_of_this_thread().since(before).minor >= 32);
    }
}

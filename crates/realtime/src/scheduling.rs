//! SCHED_FIFO priority, core and locked memory: asked for, obtained or not, and said so.

use crate::dma_latency::CpuDmaLatency;
use crate::memory::{lock_memory, prefault_stack};
use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::unistd::Pid;
use serde::{Deserialize, Serialize};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id, thread_schedule_policy_param,
};

/// What a process asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Wanted {
    /// SCHED_FIFO priority, 1 to 99; `None` for the normal scheduler.
    pub priority: Option<u8>,
    /// The core to stay on; `None` for any.
    pub core: Option<usize>,
    /// Whether memory shall be locked and the CPU kept from deep sleep.
    pub lock_memory: bool,
}

/// What it got, and why not more.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Obtained {
    /// SCHED_FIFO priority; `None` under the normal scheduler.
    pub priority: Option<u8>,
    /// The core that the process stays on.
    pub core: Option<usize>,
    /// Whether all memory, present and future, is locked.
    pub memory_locked: bool,
    /// Whether /dev/cpu_dma_latency is held at 0.
    pub cpu_dma_latency_held: bool,
    /// What was asked for and refused, in words, with what would help.
    pub refused: Vec<String>,
}

impl Obtained {
    /// Whether everything asked for was obtained.
    pub fn complete(&self) -> bool {
        self.refused.is_empty()
    }
}

/// Asks the kernel for `wanted` for the calling thread, after touching the stack that it will use. Never fails:
/// what is refused is listed. The guard holds /dev/cpu_dma_latency for as long as it lives.
pub fn obtain(wanted: &Wanted) -> (Obtained, Option<CpuDmaLatency>) {
    let mut obtained = Obtained::default();
    let mut guard = None;
    if let Some(core) = wanted.core {
        match pin(core) {
            Ok(()) => obtained.core = Some(core),
            Err(error) => obtained
                .refused
                .push(format!("core {core}: {error}; the machine's cores are in /proc/cpuinfo")),
        }
    }
    if wanted.lock_memory {
        match lock_memory() {
            Ok(()) => obtained.memory_locked = true,
            Err(error) => {
                obtained.refused.push(format!("mlockall: {error}; raise the memlock limit (ulimit -l)"))
            }
        }
        match CpuDmaLatency::hold() {
            Ok(held) => {
                obtained.cpu_dma_latency_held = true;
                guard = Some(held);
            }
            Err(error) => {
                obtained.refused.push(format!("/dev/cpu_dma_latency: {error}; give this user write access"))
            }
        }
    }
    prefault_stack();
    if let Some(priority) = wanted.priority {
        match fifo(priority) {
            Ok(()) => obtained.priority = Some(priority),
            Err(error) => {
                obtained
                    .refused
                    .push(format!("SCHED_FIFO {priority}: {error}; raise the rtprio limit (ulimit -r)"));
            }
        }
    }
    (obtained, guard)
}

/// The calling thread's SCHED_FIFO priority; `None` under any other policy.
pub fn current_fifo_priority() -> Option<u8> {
    let native = thread_native_id();
    let (policy, parameters) = thread_schedule_policy_param(native).ok()?;
    let fifo = policy == ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    fifo.then(|| u8::try_from(parameters.sched_priority).ok()).flatten()
}

/// The cores that this process may run on; none where the system doesn't say.
pub fn cores() -> Vec<usize> {
    let Ok(cores) = sched_getaffinity(Pid::from_raw(0)) else { return Vec::new() };
    (0..CpuSet::count()).filter(|core| cores.is_set(*core).unwrap_or(false)).collect()
}

fn pin(core: usize) -> nix::Result<()> {
    let mut cores = CpuSet::new();
    cores.set(core)?;
    sched_setaffinity(Pid::from_raw(0), &cores)
}

fn fifo(priority: u8) -> Result<(), String> {
    let value = ThreadPriorityValue::try_from(priority).map_err(|error| error.to_string())?;
    set_thread_priority_and_policy(
        thread_native_id(),
        ThreadPriority::Crossplatform(value),
        ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo),
    )
    .map_err(|error| match error {
        thread_priority::Error::OS(code) => std::io::Error::from_raw_os_error(code).to_string(),
        other => format!("{other:?}"),
    })
}

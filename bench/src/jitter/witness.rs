//! A witness of lowest priority on the loop's core: it sees what takes the core from everybody.
//!
//! It reads the clock without pause under SCHED_IDLE. When time has jumped, its own CPU time says whether somebody
//! else ran (ours, or the load: its CPU time stood still) or the core itself stood still while the witness had it
//! (its CPU time went on): a hypervisor that took the core, firmware, an interrupt. So what we execute is subtracted
//! by the kernel's own account. What it can't see is a stall while somebody else has the core; its share says how
//! much of the time it had.

use crate::timing::Times;
use anyhow::Result;
use nix::time::{ClockId, clock_gettime};
use realtime::{Wanted, now_ns, obtain};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use thread_priority::{
    NormalThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// A jump of the clock that is looked at, ns.
const JUMP_NS: u64 = 3_000;

/// A witness at work.
pub struct Witness {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Result<Seen>>,
    core: usize,
    steal_before: Option<u64>,
}

/// What a witness saw.
#[derive(Debug, Clone)]
pub struct Seen {
    /// How long the core stood still each time.
    pub stalls: Times,
    /// How long the witness looked, ns.
    pub wall_ns: u64,
    /// How long of that it had the core, ns.
    pub on_core_ns: u64,
    /// Time that the hypervisor says it took from the core meanwhile, ns; unknown where the kernel doesn't tell.
    pub steal_ns: Option<u64>,
}

impl Witness {
    /// Starts one on a core.
    pub fn on(core: usize) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let thread = std::thread::spawn(move || watch(core, &flag));
        Self { stop, thread, core, steal_before: steal_ns(core) }
    }

    /// Ends it; what it saw.
    ///
    /// # Errors
    /// Where it could not take the lowest priority, which would disturb what it watches.
    pub fn end(self) -> Result<Seen> {
        self.stop.store(true, Ordering::Relaxed);
        let mut seen = self.thread.join().map_err(|_| anyhow::anyhow!("the witness died"))??;
        let steal_after = steal_ns(self.core);
        seen.steal_ns =
            steal_after.zip(self.steal_before).map(|(after, before)| after.saturating_sub(before));
        Ok(seen)
    }
}

impl Seen {
    /// Nothing yet.
    ///
    /// # Errors
    /// As [`Times::new`].
    pub fn nothing() -> Result<Self> {
        Ok(Self { stalls: Times::new()?, wall_ns: 0, on_core_ns: 0, steal_ns: Some(0) })
    }

    /// Adds what another saw.
    pub fn add(&mut self, other: &Self) {
        self.stalls.add_times(&other.stalls);
        self.wall_ns += other.wall_ns;
        self.on_core_ns += other.on_core_ns;
        self.steal_ns = self.steal_ns.zip(other.steal_ns).map(|(a, b)| a + b);
    }

    /// Part of the time that it had the core.
    pub fn share(&self) -> f64 {
        self.on_core_ns as f64 / self.wall_ns.max(1) as f64
    }
}

fn watch(core: usize, stop: &AtomicBool) -> Result<Seen> {
    // Before it steps behind everybody else: on a busy core it may wait for long until its first look.
    let (begun_ns, begun_cpu_ns) = (now_ns(), cpu_ns()?);
    let (obtained, _) = obtain(&Wanted { priority: None, core: Some(core), lock_memory: false });
    anyhow::ensure!(obtained.complete(), "the witness: {}", obtained.refused.join("; "));
    set_thread_priority_and_policy(
        thread_native_id(),
        ThreadPriority::Min,
        ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Idle),
    )
    .map_err(|error| anyhow::anyhow!("the witness, SCHED_IDLE: {error:?}"))?;
    let mut seen = Seen::nothing()?;
    let (mut since_ns, mut since_cpu_ns) = (now_ns(), cpu_ns()?);
    let mut last_ns = since_ns;
    while !stop.load(Ordering::Relaxed) {
        let now = now_ns();
        if now.saturating_sub(last_ns) < JUMP_NS {
            last_ns = now;
            continue;
        }
        let cpu = cpu_ns()?;
        // Until `last_ns` the core was the witness's; the rest of its CPU time passed in the jump.
        let stalled = (cpu - since_cpu_ns).saturating_sub(last_ns - since_ns);
        if stalled >= JUMP_NS {
            seen.stalls.add(stalled);
        }
        since_cpu_ns = cpu;
        since_ns = now_ns();
        last_ns = since_ns;
    }
    seen.wall_ns = now_ns() - begun_ns;
    seen.on_core_ns = cpu_ns()? - begun_cpu_ns;
    Ok(seen)
}

fn cpu_ns() -> Result<u64> {
    let time = clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID)?;
    Ok(time.tv_sec().unsigned_abs() * 1_000_000_000 + time.tv_nsec().unsigned_abs())
}

/// Time stolen from a core since boot, in ns, as /proc/stat tells it in hundredths of a second.
fn steal_ns(core: usize) -> Option<u64> {
    let stat = std::fs::read_to_string("/proc/stat").ok()?;
    let name = format!("cpu{core}");
    let line = stat.lines().find(|line| line.split_whitespace().next() == Some(name.as_str()))?;
    let hundredths: u64 = line.split_whitespace().nth(8)?.parse().ok()?;
    Some(hundredths * 10_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn it_had_the_core_no_longer_than_it_looked() {
        let witness = Witness::on(0);
        std::thread::sleep(Duration::from_millis(300));
        let seen = witness.end().unwrap();
        assert!(seen.wall_ns >= 290_000_000, "{seen:?}");
        assert!(seen.on_core_ns <= seen.wall_ns + 10_000_000, "{seen:?}");
        assert!(seen.stalls.max_ns() <= seen.wall_ns);
    }
}

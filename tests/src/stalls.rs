//! Tests that run in real time, on machines that stall: a try during which the machine stood still is no evidence.

use crate::TestPlace;
use realtime::{Wanted, now_ns, obtain};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{scope, sleep};
use std::time::Duration;

/// Tries at the most: virtual machines' stalls come in bursts, and some last for 40 ms.
const TRIES: u32 = 8;

/// A core that stood still for half a cycle of 1 ms may have made the loop miss what it is tested for, ns.
const STALL_NS: u64 = 500_000;

/// How long the witness of a core sleeps at a time.
const NAP: Duration = Duration::from_micros(200);

/// A time in which a core did not run its witness, ns of CLOCK_MONOTONIC.
#[derive(Clone, Copy)]
struct Stall {
    core: usize,
    /// Whether the witness was above every other thread: else one of them may have kept it from running.
    above_all: bool,
    from_ns: u64,
    to_ns: u64,
}

/// The stalls seen since a try began.
#[derive(Default)]
pub struct Stalls(Mutex<Vec<Stall>>);

impl Stalls {
    fn longest_ns(&self) -> Option<u64> {
        self.list().iter().map(|stall| stall.to_ns - stall.from_ns).max()
    }

    /// Each time, in ns, for which a core ran nobody, not even a thread above every other, if some of it lies between two moments of
    /// CLOCK_MONOTONIC. None where the system grants no such thread.
    pub fn of_core(&self, core: usize, from_ns: u64, to_ns: u64) -> Vec<u64> {
        let meets = |stall: &&Stall| {
            stall.above_all && stall.core == core && stall.from_ns < to_ns && stall.to_ns > from_ns
        };
        self.list().iter().filter(meets).map(|stall| stall.to_ns - stall.from_ns).collect()
    }

    fn note(&self, stall: Stall) {
        self.0.lock().expect("no witness panics").push(stall);
    }

    fn list(&self) -> Vec<Stall> {
        self.0.lock().expect("no witness panics").clone()
    }
}

/// Runs a test in a new place, and again in another one as long as it fails while the machine stalls. A failure without
/// a stall, or in all of eight tries, is the test's.
///
/// # Panics
/// As the test does.
pub fn despite_stalls(test: impl Fn(&TestPlace)) {
    despite_stalls_seen(|place, _| test(place));
}

/// The same for a test that looks at the stalls seen while it runs.
///
/// # Panics
/// As the test does.
pub fn despite_stalls_seen(test: impl Fn(&TestPlace, &Stalls)) {
    for attempt in 1.. {
        let (place, stalls) = (TestPlace::new(), Stalls::default());
        let result = with_witness(&stalls, || catch_unwind(AssertUnwindSafe(|| test(&place, &stalls))));
        let Err(failure) = result else { return };
        let Some(longest_ns) = stalls.longest_ns().filter(|_| attempt < TRIES) else {
            resume_unwind(failure)
        };
        println!("try {attempt}: the machine stalled for {:.1} ms meanwhile; again", longest_ns as f64 / 1e6);
        // Each pause is twice the one before: a burst of stalls may last for a minute.
        sleep(Duration::from_secs(1 << (attempt - 1)));
    }
}

/// What `work` gives; meanwhile a thread above every other on each core notes when its core did not run it.
fn with_witness<T>(stalls: &Stalls, work: impl FnOnce() -> T) -> T {
    let over = AtomicBool::new(false);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    scope(|scope| {
        for core in 0..cores {
            let over = &over;
            scope.spawn(move || witness(core, over, stalls));
        }
        let result = work();
        over.store(true, Ordering::Relaxed);
        result
    })
}

/// Sleeps for a fifth of the loop's cycle, again and again, and notes each stall. A sleep as long as the cycle would
/// miss a stall that begins and ends within it.
fn witness(core: usize, over: &AtomicBool, stalls: &Stalls) {
    let wanted = Wanted { core: Some(core), priority: Some(95), lock_memory: false };
    let (obtained, _guard) = obtain(&wanted);
    let above_all = obtained.priority.is_some() && obtained.core.is_some();
    while !over.load(Ordering::Relaxed) {
        let wanted_ns = now_ns() + NAP.as_nanos() as u64;
        sleep(NAP);
        let woken_ns = now_ns();
        if woken_ns > wanted_ns + STALL_NS {
            stalls.note(Stall { core, above_all, from_ns: wanted_ns, to_ns: woken_ns });
        }
    }
}

//! Tests that run in real time, on machines that stall: a try during which the machine stood still is no evidence.

use crate::TestPlace;
use realtime::{Wanted, now_ns, obtain};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{scope, sleep};
use std::time::Duration;

/// Tries at the most: virtual machines' stalls come in bursts, and some last for 40 ms.
const TRIES: u32 = 8;

/// The longest pause before another try: a burst may last for a minute. The first pause is a second, each further one twice as long.
const LONGEST_PAUSE: Duration = Duration::from_secs(60);

/// A core that stood still for half a cycle of 1 ms may have made the loop miss what it is tested for, ns.
const STALL_NS: u64 = 500_000;

/// How long the witness of a core sleeps at a time.
const NAP: Duration = Duration::from_micros(200);

/// Runs a test in a new place, and again in another one as long as it fails while the machine stalls. A failure without
/// a stall, or in all of eight tries, is the test's.
///
/// # Panics
/// As the test does.
pub fn despite_stalls(test: impl Fn(&TestPlace)) {
    for attempt in 1.. {
        let place = TestPlace::new();
        let (result, stall_ns) = with_witness(|| catch_unwind(AssertUnwindSafe(|| test(&place))));
        let Err(failure) = result else { return };
        if stall_ns < STALL_NS || attempt == TRIES {
            resume_unwind(failure);
        }
        println!("try {attempt}: the machine stalled for {:.1} ms meanwhile; again", stall_ns as f64 / 1e6);
        sleep(LONGEST_PAUSE.min(Duration::from_secs(1 << (attempt - 1))));
    }
}

/// What `work` gives, and the longest time for which a core did not run a thread above every other while it worked.
fn with_witness<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let (over, longest_ns) = (AtomicBool::new(false), AtomicU64::new(0));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let result = scope(|scope| {
        for core in 0..cores {
            scope.spawn({
                let (over, longest_ns) = (&over, &longest_ns);
                move || witness(core, over, longest_ns)
            });
        }
        let result = work();
        over.store(true, Ordering::Relaxed);
        result
    });
    (result, longest_ns.into_inner())
}

/// Sleeps for a fifth of the loop's cycle, again and again, and notes by how much the longest sleep was late. A sleep as long as the cycle
/// would miss a stall that begins and ends within it.
fn witness(core: usize, over: &AtomicBool, longest_ns: &AtomicU64) {
    let wanted = Wanted { core: Some(core), priority: Some(95), lock_memory: false };
    let _guard = obtain(&wanted);
    while !over.load(Ordering::Relaxed) {
        let before_ns = now_ns();
        sleep(NAP);
        let late_ns =
            Duration::from_nanos(now_ns().saturating_sub(before_ns)).saturating_sub(NAP).as_nanos() as u64;
        longest_ns.fetch_max(late_ns, Ordering::Relaxed);
    }
}

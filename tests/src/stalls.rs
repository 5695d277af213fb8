//! Tests that run in real time, on machines that stall: a try during which the machine stood still is no evidence.

use crate::TestPlace;
use machine_stalls::{Stall, Stalls};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::thread::sleep;
use std::time::Duration;

/// Tries at the most: virtual machines' stalls come in bursts, and some last for 40 ms.
const TRIES: u32 = 8;

/// A core that stood still for half a cycle of 1 ms may have made the loop miss what it is tested for.
const LATE: Duration = Duration::from_micros(500);

/// How long the witness of a core sleeps at a time: a fifth of the loop's cycle. A sleep as long as the cycle would miss a stall that
/// begins and ends within it.
const NAP: Duration = Duration::from_micros(200);

/// Each time, in ns, for which a core ran nobody, not even a thread above every other, if some of it lies between two moments of
/// CLOCK_MONOTONIC. None where the system grants no such thread.
#[must_use]
pub fn stood_still_ns(stalls: &Stalls, core: usize, from_ns: u64, to_ns: u64) -> Vec<u64> {
    let meets = |stall: &&Stall| stall.above_all && stall.core == core && stall.within_ns(from_ns, to_ns) > 0;
    stalls.seen().iter().filter(meets).map(Stall::length_ns).collect()
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
        let (place, stalls) = (TestPlace::new(), Stalls::watch(NAP, LATE));
        let result = catch_unwind(AssertUnwindSafe(|| test(&place, &stalls)));
        let Err(failure) = result else { return };
        let longest_ns = stalls.seen().iter().map(Stall::length_ns).max();
        let Some(longest_ns) = longest_ns.filter(|_| attempt < TRIES) else { resume_unwind(failure) };
        println!("try {attempt}: the machine stalled for {:.1} ms meanwhile; again", longest_ns as f64 / 1e6);
        drop(stalls);
        // Each pause is twice the one before: a burst of stalls may last for a minute.
        sleep(Duration::from_secs(1 << (attempt - 1)));
    }
}

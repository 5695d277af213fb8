//! The clock that ethercrab, built without the standard library, asks for through embassy-time. It is what the calling thread was
//! told last: whoever polls ethercrab's futures tells the time of its link, which in a test need not be the machine's.

use core::cell::Cell;
use core::task::Waker;
use embassy_time_driver::{Driver, time_driver_impl};

thread_local! {
    static NOW_NS: Cell<u64> = const { Cell::new(0) };
}

/// Tells this thread's futures the time, ns; it must not go back.
pub fn tell_time(now_ns: u64) {
    NOW_NS.with(|now| now.set(now_ns));
}

/// The time that was told last, ns.
pub fn told_time() -> u64 {
    NOW_NS.with(Cell::get)
}

struct Told;

impl Driver for Told {
    fn now(&self) -> u64 {
        told_time() / 1_000
    }

    /// Whoever waits is polled again and again, so nothing has to be woken.
    fn schedule_wake(&self, _at: u64, _waker: &Waker) {}
}

time_driver_impl!(static CLOCK: Told = Told);

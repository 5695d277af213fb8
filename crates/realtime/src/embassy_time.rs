//! The clock that ethercrab, built without the standard library, asks for through embassy-time: CLOCK_MONOTONIC in µs.

use crate::clock::now_ns;
use core::task::Waker;
use embassy_time_driver::{Driver, time_driver_impl};

struct Monotonic;

impl Driver for Monotonic {
    fn now(&self) -> u64 {
        now_ns() / 1_000
    }

    /// Whoever waits is polled again and again, so nothing has to be woken.
    fn schedule_wake(&self, _at: u64, _waker: &Waker) {}
}

time_driver_impl!(static CLOCK: Monotonic = Monotonic);

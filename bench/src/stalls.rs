//! How stalls of the machine are watched for, and added up, beside a bus.

use machine_stalls::{Stall, Stalls};
use std::time::Duration;

const NAP: Duration = Duration::from_millis(1);
/// A frame on its way may be late by as much.
const LATE: Duration = Duration::from_micros(200);

/// Watches from now on.
pub fn watch() -> Stalls {
    Stalls::watch(NAP, LATE)
}

/// For how long the machine stood still between two times at the most, ns: stalls of several cores are added.
pub fn within(stalls: &[Stall], from_ns: u64, to_ns: u64) -> u64 {
    stalls.iter().map(|stall| stall.within_ns(from_ns, to_ns)).sum()
}

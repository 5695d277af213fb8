//! How long a frame takes to the devices and back, tried: it reads one register of all of them and changes nothing.

use crate::doctor::finding::{Finding, Topic};
use ethercat_link::{PacketLink, Probe, probe};

const ROUND_TRIP: Topic = Topic {
    id: "bus-round-trip",
    what: "round trip on the drive's bus",
    why: "The reply has to be there before the trajectory's phase, at most at 40 % of the cycle.",
};

/// Longer than this part of a cycle of 1 ms is too long, ns: the frame goes out at 10 % and is back at 40 %.
const TOO_LONG_NS: u64 = 300_000;

/// Tries it.
pub fn look(interface: &str) -> Finding {
    let mut link = match PacketLink::open(interface) {
        Ok(link) => link,
        Err(error) => return ROUND_TRIP.unknown(format!("{interface}: {error}"), ""),
    };
    let Probe { sent, answered, devices, median_ns, longest_ns } = probe(&mut link);
    if answered == 0 {
        return ROUND_TRIP
            .problem(format!("{interface}: no device answers"), "cable, and power of the drive");
    }
    let us = |ns: u64| ns / 1000;
    let found = format!(
        "{interface}: {devices} devices, median {} µs, longest {} µs, {answered} of {sent} answered",
        us(median_ns),
        us(longest_ns)
    );
    if median_ns > TOO_LONG_NS || answered < sent {
        return ROUND_TRIP.problem(found, "the findings above; a cycle longer than 1 ms");
    }
    ROUND_TRIP.ok(found)
}

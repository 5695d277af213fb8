//! Interrupt coalescing: how long the interface waits for more frames before it hands them on.

use super::ethtool::ask;
use crate::doctor::finding::{Finding, Topic};

const COALESCING: Topic = Topic {
    id: "nic-coalescing",
    what: "interrupt coalescing of the bus's interface",
    why: "An interface that waits for more frames before it interrupts delays every cycle's frame by as much.",
};

/// How long frames wait for an interrupt.
pub fn look(interface: &str) -> Finding {
    match ask(&COALESCING, "-c", interface) {
        Ok(text) => judge(interface, &text),
        Err(finding) => *finding,
    }
}

fn judge(interface: &str, text: &str) -> Finding {
    let value = |name: &str| {
        let line = text.lines().find_map(|line| line.trim().strip_prefix(name)?.strip_prefix(':'))?;
        line.trim().parse::<u64>().ok()
    };
    let adaptive = text
        .lines()
        .find_map(|line| line.trim().strip_prefix("Adaptive RX:"))
        .is_some_and(|line| line.split_whitespace().next() == Some("on"));
    let fix = format!("ethtool -C {interface} adaptive-rx off rx-usecs 0 tx-usecs 0");
    match (value("rx-usecs"), value("tx-usecs")) {
        _ if adaptive => COALESCING.problem(format!("{interface}: adaptive"), fix),
        (Some(0), Some(0)) => COALESCING.ok(format!("{interface}: none")),
        (Some(rx), Some(tx)) => {
            COALESCING.problem(format!("{interface}: {rx} µs on receipt, {tx} µs on sending"), fix)
        }
        _ => COALESCING.unknown(format!("{interface}: ethtool -c gives no times"), ""),
    }
}

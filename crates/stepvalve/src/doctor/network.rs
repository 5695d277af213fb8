//! A network interface that carries a drive's bus: whether it hands on a frame at once.

use super::finding::{Finding, Topic};
use super::root::Root;
use std::process::{Command, Stdio};

const COALESCING: Topic = Topic {
    id: "nic-coalescing",
    what: "interrupt coalescing of the bus's interface",
    why: "An interface that waits for more frames before it interrupts delays every cycle's frame by as much.",
};

/// One finding for each interface.
pub fn look(root: &Root, interfaces: &[String]) -> Vec<Finding> {
    interfaces.iter().map(|interface| coalescing(root, interface)).collect()
}

fn coalescing(root: &Root, interface: &str) -> Finding {
    match root.names("/sys/class/net") {
        None => return COALESCING.unknown("/sys/class/net can't be read", ""),
        Some(names) if !names.iter().any(|name| name == interface) => {
            let found = format!("{interface} is not there; there are: {}", names.join(", "));
            return COALESCING.problem(found, "ip link shows the interfaces");
        }
        Some(_) => {}
    }
    let asked = Command::new("ethtool").args(["-c", interface]).stdin(Stdio::null()).output();
    let text = match asked {
        Ok(output) if output.status.success() => String::from_utf8_lossy(&output.stdout).into_owned(),
        Ok(output) => {
            let reason = String::from_utf8_lossy(&output.stderr).trim().replace('\n', "; ");
            return COALESCING.unknown(format!("{interface}: ethtool -c: {reason}"), "");
        }
        Err(error) => {
            return COALESCING.unknown(format!("{interface}: ethtool: {error}"), "apt-get install ethtool");
        }
    };
    judge(interface, &text)
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

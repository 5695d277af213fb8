//! A network interface that carries a drive's bus: whether it is the drive's alone, and hands on a frame at once.

mod coalescing;
mod ethtool;
mod link;
mod managers;
mod power;
mod round_trip;

use super::finding::{Finding, Topic};
use super::interrupts;
use super::rights;
use super::root::{Root, list};

const RAW_SOCKET: Topic = Topic {
    id: "nic-raw-socket",
    what: "right to raw sockets (CAP_NET_RAW)",
    why: "valve-bridge sends EtherCAT frames itself. Without the right it ends at once.",
};
const INTERRUPTS: Topic = Topic {
    id: "nic-interrupts",
    what: "interrupts of the bus's interface",
    why: "An interrupt that wanders between cores makes the reply of some cycles late. One core, always the same, is even.",
};

/// All that can be known of each interface.
pub fn look(root: &Root, interfaces: &[String]) -> Vec<Finding> {
    interfaces.iter().flat_map(|interface| look_at(root, interface)).collect()
}

fn look_at(root: &Root, interface: &str) -> Vec<Finding> {
    let link = link::look(root, interface);
    let there = root.names("/sys/class/net").is_some_and(|names| names.iter().any(|name| name == interface));
    if !there {
        return vec![link];
    }
    let mut findings = vec![
        link,
        link::driver(root, interface),
        link::address(root, interface),
        managers::look(root, interface),
        coalescing::look(interface),
        ethtool::offloads(root, interface),
        power::energy_efficient_ethernet(interface),
        interrupts(root, interface),
        raw_socket(root),
    ];
    if root.is_machine() {
        findings.push(round_trip::look(interface));
    }
    findings
}

fn raw_socket(root: &Root) -> Finding {
    const CAP_NET_RAW: u32 = 13;
    match rights::capability(root, CAP_NET_RAW) {
        Some(true) => RAW_SOCKET.ok("this process has it"),
        Some(false) => RAW_SOCKET.advice(
            "this process does not have it",
            "for a service rt-config/systemd/drive.conf as a drop-in; for a shell: setpriv --ambient-caps +net_raw, as root",
        ),
        None => RAW_SOCKET.unknown("/proc/self/status can't be read", ""),
    }
}

fn interrupts(root: &Root, interface: &str) -> Finding {
    let Some(all) = interrupts::handlers(root) else {
        return INTERRUPTS.unknown("/proc/irq can't be read", "");
    };
    // Such as eth1, eth1-TxRx-0, eth1:rx.
    let bears = |handler: &str| {
        let rest = handler.strip_prefix(interface);
        rest.is_some_and(|rest| !rest.starts_with(|next: char| next.is_ascii_alphanumeric()))
    };
    let own: Vec<_> = all.iter().filter(|interrupt| bears(&interrupt.handler)).collect();
    if own.is_empty() {
        return INTERRUPTS
            .unknown(format!("none bears the name of {interface}"), "ls /proc/irq/*/ names them all");
    }
    let text = |interrupt: &&interrupts::Interrupt| {
        let cores = interrupt.cores.as_ref().map_or_else(|| "?".to_owned(), list);
        format!("{} {} on core {cores}", interrupt.number, interrupt.handler)
    };
    let found = own.iter().map(text).collect::<Vec<_>>().join(", ");
    if own.iter().all(|interrupt| interrupt.cores.as_ref().is_some_and(|cores| cores.len() == 1)) {
        return INTERRUPTS.ok(found);
    }
    let numbers: Vec<_> = own.iter().map(|interrupt| interrupt.number.as_str()).collect();
    INTERRUPTS.advice(
        found,
        format!(
            "echo 0 > /proc/irq/NUMBER/smp_affinity_list for NUMBER in {}, after each start",
            numbers.join(", ")
        ),
    )
}

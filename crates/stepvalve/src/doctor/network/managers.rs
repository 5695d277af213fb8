//! Programs that configure interfaces by themselves.

use crate::doctor::finding::{Finding, Topic};
use crate::doctor::root::Root;
use std::process::{Command, Stdio};

const MANAGERS: Topic = Topic {
    id: "nic-manager",
    what: "programs that configure the bus's interface",
    why: "They ask for addresses on it and take it down and up again, which the drive sees as a cable that is out.",
};

/// Whom the kernel names so (it keeps 15 characters).
const DHCP_CLIENTS: [&str; 4] = ["dhcpcd", "dhclient", "udhcpc", "connmand"];

/// Who does.
pub fn look(root: &Root, interface: &str) -> Finding {
    let Some(names) = root.names("/proc") else {
        return MANAGERS.unknown("/proc can't be read", "");
    };
    let numbers = names.iter().filter(|name| name.parse::<u32>().is_ok());
    let running: Vec<_> = numbers.filter_map(|number| root.text(&format!("/proc/{number}/comm"))).collect();
    if running.is_empty() {
        return MANAGERS.unknown("no process can be seen", "");
    }
    let runs = |name: &str| running.iter().any(|other| other == name);
    if runs("NetworkManager") && network_manager_has(interface) {
        let fix = format!(
            "nmcli device set {interface} managed no; for good: unmanaged-devices=interface-name:{interface} under [keyfile] in \
             /etc/NetworkManager/conf.d"
        );
        return MANAGERS.problem(format!("NetworkManager has {interface}"), fix);
    }
    if runs("systemd-network") && networkd_has(root, interface) {
        let fix =
            format!("[Match] Name={interface} and [Link] Unmanaged=yes in a file of /etc/systemd/network");
        return MANAGERS.problem(format!("systemd-networkd has {interface}"), fix);
    }
    match DHCP_CLIENTS.into_iter().find(|name| runs(name)) {
        Some(name) => MANAGERS.advice(
            format!("{name} runs, and may have {interface}"),
            format!("leave {interface} out of its configuration (dhcpcd: denyinterfaces {interface})"),
        ),
        None => MANAGERS.ok(format!("none has {interface}")),
    }
}

/// Also where it does not answer.
fn network_manager_has(interface: &str) -> bool {
    let asked = Command::new("nmcli")
        .args(["-g", "GENERAL.STATE", "device", "show", interface])
        .stdin(Stdio::null())
        .output();
    asked.map_or(true, |output| !String::from_utf8_lossy(&output.stdout).contains("unmanaged"))
}

fn networkd_has(root: &Root, interface: &str) -> bool {
    let Some(index) = root.text(&format!("/sys/class/net/{interface}/ifindex")) else { return true };
    let state = root.text(&format!("/run/systemd/netif/links/{index}"));
    state.is_none_or(|state| !state.lines().any(|line| line == "ADMIN_STATE=unmanaged"))
}

//! The interface itself: its link, what card it is, and whether anything else than the drive is on it.

use crate::doctor::finding::{Finding, Topic};
use crate::doctor::root::Root;

const LINK: Topic = Topic {
    id: "nic-link",
    what: "link of the bus's interface",
    why: "Without a link there is no drive. EtherCAT runs at 100 Mbit/s.",
};
const DRIVER: Topic = Topic {
    id: "nic-driver",
    what: "card of the bus's interface",
    why: "Adapters on USB hand frames on with their bus's next turn, and some cards' drivers by batches.",
};
const ADDRESS: Topic = Topic {
    id: "nic-address",
    what: "addresses of the bus's interface",
    why: "With an IP address the machine sends frames of its own between the drive's, at any time in a cycle.",
};

/// Cards whose drivers are known to delay frames: Realtek's.
const SLOW_DRIVERS: [&str; 4] = ["r8169", "r8168", "r8125", "8139too"];
/// What EtherCAT runs at, Mbit/s.
const ETHERCAT_MBIT: i64 = 100;

/// Its link.
pub fn look(root: &Root, interface: &str) -> Finding {
    match root.names("/sys/class/net") {
        None => return LINK.unknown("/sys/class/net can't be read", ""),
        Some(names) if !names.iter().any(|name| name == interface) => {
            let found = format!("{interface} is not there; there are: {}", names.join(", "));
            return LINK.problem(found, "ip link shows the interfaces");
        }
        Some(_) => {}
    }
    let read = |name: &str| root.text(&format!("/sys/class/net/{interface}/{name}"));
    // Of an interface that is down the kernel gives no carrier.
    match read("carrier").as_deref() {
        Some("1") => {}
        Some(_) => return LINK.problem(format!("{interface}: no link"), "cable, and power of the drive"),
        None if read("operstate").is_some() => {
            return LINK.problem(format!("{interface} is down"), format!("ip link set {interface} up"));
        }
        None => return LINK.unknown(format!("{interface}: carrier can't be read"), ""),
    }
    match read("speed").and_then(|speed| speed.parse::<i64>().ok()) {
        Some(speed) if speed > 0 && speed < ETHERCAT_MBIT => {
            LINK.problem(format!("{interface}: {speed} Mbit/s"), "another cable or port")
        }
        Some(speed) if speed > 0 => LINK.ok(format!("{interface}: {speed} Mbit/s")),
        _ => LINK.ok(format!("{interface}: up")),
    }
}

/// What card it is.
pub fn driver(root: &Root, interface: &str) -> Finding {
    let device = root.path(&format!("/sys/class/net/{interface}/device"));
    let Ok(place) = std::fs::canonicalize(&device) else {
        let found = format!("{interface}: no card behind it (a virtual interface)");
        return DRIVER.advice(found, "a card of the machine's own, for the drive alone");
    };
    let driver = std::fs::read_link(device.join("driver")).ok();
    let driver = driver.as_ref().and_then(|path| path.file_name());
    let name = driver.map_or("of a driver without a name".into(), |name| name.to_string_lossy());
    if place.components().any(|part| part.as_os_str().to_string_lossy().starts_with("usb")) {
        return DRIVER.problem(format!("{interface}: {name}, on USB"), "a card on PCI Express");
    }
    if SLOW_DRIVERS.contains(&name.as_ref()) {
        let fix = "try it with `stepvalve bus capture` and the round trip below; Intel's cards (igb, igc, e1000e) are even";
        return DRIVER.advice(format!("{interface}: {name}, a Realtek card"), fix);
    }
    DRIVER.ok(format!("{interface}: {name}"))
}

/// Whether it has addresses, or routes over it.
pub fn address(root: &Root, interface: &str) -> Finding {
    let lines = |path: &str, column: usize| {
        let text = root.text(path)?;
        let on_it = |line: &&str| line.split_whitespace().nth(column) == Some(interface);
        Some(text.lines().filter(on_it).count())
    };
    // Every IPv4 address brings its network's route.
    let (routes, addresses) = (lines("/proc/net/route", 0), lines("/proc/net/if_inet6", 5));
    let fix = format!(
        "ip addr flush dev {interface}; sysctl -w net.ipv6.conf.{interface}.disable_ipv6=1; for good: leave it out of the \
         network's configuration"
    );
    match (routes, addresses) {
        (None, None) => ADDRESS.unknown("/proc/net/route can't be read", ""),
        (Some(0), None | Some(0)) | (None, Some(0)) => ADDRESS.ok(format!("{interface}: none")),
        (routes, Some(addresses)) if routes.unwrap_or(0) == 0 => {
            ADDRESS.advice(format!("{interface}: {addresses} of IPv6"), fix)
        }
        _ => ADDRESS.problem(format!("{interface}: of IPv4, with routes"), fix),
    }
}

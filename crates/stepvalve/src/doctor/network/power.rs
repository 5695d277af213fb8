//! Energy-efficient Ethernet: a link that sleeps between frames.

use super::ethtool::ask;
use crate::doctor::finding::{Finding, Topic};

const ENERGY: Topic = Topic {
    id: "nic-energy-efficient-ethernet",
    what: "energy-efficient Ethernet on the bus's interface",
    why: "A link that sleeps between two cycles' frames needs 20 to 30 µs to wake, in every cycle.",
};

/// Whether the link sleeps.
pub fn energy_efficient_ethernet(interface: &str) -> Finding {
    let text = match ask(&ENERGY, "--show-eee", interface) {
        Ok(text) => text,
        // A card that can't do it.
        Err(finding) if finding.found.contains("not supported") => {
            return ENERGY.ok(format!("{interface}: the card has none"));
        }
        Err(finding) => return *finding,
    };
    let status = text.lines().find_map(|line| line.trim().strip_prefix("EEE status:")).map(str::trim);
    match status {
        Some(status) if status.starts_with("enabled") => {
            ENERGY.problem(format!("{interface}: {status}"), format!("ethtool --set-eee {interface} eee off"))
        }
        Some(status) => ENERGY.ok(format!("{interface}: {status}")),
        None => ENERGY.unknown(format!("{interface}: ethtool --show-eee gives no status"), ""),
    }
}

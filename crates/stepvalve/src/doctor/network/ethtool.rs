//! What `ethtool` tells of an interface, and what the kernel does with frames before it hands them on.

use crate::doctor::finding::{Finding, Topic};
use crate::doctor::root::Root;
use std::process::{Command, Stdio};

const OFFLOADS: Topic = Topic {
    id: "nic-offloads",
    what: "merging of frames on the bus's interface",
    why: "Frames that are held back to be merged with the next ones come late; a drive's frames never can be merged.",
};

/// Names of offloads that hold frames back, and how ethtool sets them.
const MERGING: [(&str, &str); 3] =
    [("generic-receive-offload", "gro"), ("large-receive-offload", "lro"), ("rx-gro-hw", "rx-gro-hw")];

/// The text that ethtool prints.
///
/// # Errors
/// A finding of `topic` that says why there is none.
pub fn ask(topic: &Topic, option: &str, interface: &str) -> Result<String, Box<Finding>> {
    let asked = Command::new("ethtool").args([option, interface]).stdin(Stdio::null()).output();
    match asked {
        Ok(output) if output.status.success() => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        Ok(output) => {
            let reason = String::from_utf8_lossy(&output.stderr).trim().replace('\n', "; ");
            Err(Box::new(topic.unknown(format!("{interface}: ethtool {option}: {reason}"), "")))
        }
        Err(error) => {
            Err(Box::new(topic.unknown(format!("{interface}: ethtool: {error}"), "apt-get install ethtool")))
        }
    }
}

/// Whether frames are held back to be merged.
pub fn offloads(root: &Root, interface: &str) -> Finding {
    for name in ["gro_flush_timeout", "napi_defer_hard_irqs"] {
        let path = format!("/sys/class/net/{interface}/{name}");
        if root.text(&path).is_some_and(|value| value != "0") {
            return OFFLOADS.problem(format!("{interface}: {name} is set"), format!("echo 0 > {path}"));
        }
    }
    let text = match ask(&OFFLOADS, "-k", interface) {
        Ok(text) => text,
        Err(finding) => return *finding,
    };
    let on = |name: &str| {
        let value = text.lines().find_map(|line| line.trim().strip_prefix(name)?.strip_prefix(':'));
        value.is_some_and(|value| value.split_whitespace().next() == Some("on"))
    };
    let on: Vec<_> = MERGING.into_iter().filter(|(name, _)| on(name)).collect();
    if on.is_empty() {
        return OFFLOADS.ok(format!("{interface}: none"));
    }
    let names: Vec<_> = on.iter().map(|(name, _)| *name).collect();
    let set: Vec<_> = on.iter().map(|(_, short)| format!("{short} off")).collect();
    OFFLOADS.advice(
        format!("{interface}: {}", names.join(", ")),
        format!("ethtool -K {interface} {}", set.join(" ")),
    )
}

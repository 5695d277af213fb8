//! The loop's cores: there, really isolated, without a tick, not shared with a sibling.

use super::finding::{Finding, Topic};
use super::root::{Root, list, parse_cores};
use super::target::Target;
use std::collections::BTreeSet;

const CORES: Topic = Topic {
    id: "cores",
    what: "the loop's cores",
    why: "A process of the loop stays on the core that the scenario gives it; recorder, operator and interrupts need \
          another.",
};
const ISOLATION: Topic = Topic {
    id: "isolated-cores",
    what: "isolated cores",
    why: "The scheduler puts nothing of its own accord on an isolated core, so that the loop need not displace it. \
          Only what the kernel lists counts: an option that it did not understand is silently left out.",
};
const NOHZ: Topic = Topic {
    id: "nohz-cores",
    what: "cores without tick",
    why: "The tick interrupts a running process up to 1000 times a second for some µs each time.",
};
const SMT: Topic = Topic {
    id: "smt",
    what: "sibling threads (SMT)",
    why: "Two threads of one core share its caches and units: whatever runs on the sibling slows the loop down.",
};

const FOLDER: &str = "/sys/devices/system/cpu";

/// All of it.
pub fn look(root: &Root, target: &Target) -> Vec<Finding> {
    vec![there(root, target), isolation(root, target), nohz(root, target), smt(root, target)]
}

fn there(root: &Root, target: &Target) -> Finding {
    let Some(online) = root.cores(&format!("{FOLDER}/online")) else {
        return CORES.unknown(format!("{FOLDER}/online can't be read"), "");
    };
    let fix = "give the processes cores that exist, under [timing] in the scenario";
    if target.cores.is_empty() {
        return CORES.advice("the scenario binds the loop to no core", fix);
    }
    let missing: BTreeSet<_> = target.cores.difference(&online).copied().collect();
    if !missing.is_empty() {
        let found = format!("core {} is not online; online: {}", list(&missing), list(&online));
        return CORES.problem(found, fix).blocking();
    }
    if online.is_subset(&target.cores) {
        let found = format!("the loop has all cores ({}); nothing is left for anything else", list(&online));
        return CORES.problem(found, fix);
    }
    CORES.ok(format!("core {} of {}", list(&target.cores), list(&online)))
}

/// Isolation at boot, and through cpuset partitions.
fn isolation(root: &Root, target: &Target) -> Finding {
    let Some(at_boot) = root.cores(&format!("{FOLDER}/isolated")) else {
        return ISOLATION.unknown(format!("{FOLDER}/isolated can't be read"), "");
    };
    let by_partition = root.cores("/sys/fs/cgroup/cpuset.cpus.isolated").unwrap_or_default();
    let in_force: BTreeSet<_> = at_boot.union(&by_partition).copied().collect();
    let wanted = list(&target.cores);
    let fix = format!(
        "isolcpus={wanted} on the kernel command line (rt-config/kernel), then look at {FOLDER}/isolated"
    );
    judge(&ISOLATION, root, "isolcpus", &in_force, target, fix)
}

fn nohz(root: &Root, target: &Target) -> Finding {
    let wanted = list(&target.cores);
    let fix = format!(
        "nohz_full={wanted} on the kernel command line (rt-config/kernel), with a kernel that has CONFIG_NO_HZ_FULL"
    );
    match root.cores(&format!("{FOLDER}/nohz_full")) {
        Some(in_force) => judge(&NOHZ, root, "nohz_full", &in_force, target, fix),
        // The folder is there and the file is not: this kernel can't.
        None if root.names(FOLDER).is_some_and(|names| !names.iter().any(|name| name == "nohz_full")) => {
            match root.command_line_option("nohz_full") {
                Some(asked) => {
                    let found =
                        format!("nohz_full={asked} is asked for, and this kernel can't: not in force");
                    NOHZ.problem(found, fix)
                }
                None => NOHZ.advice("none: this kernel keeps its tick on every busy core", fix),
            }
        }
        None => NOHZ.unknown(format!("{FOLDER}/nohz_full can't be read"), ""),
    }
}

/// What is asked for on the command line, what is in force, and where the loop is.
fn judge(
    topic: &Topic,
    root: &Root,
    option: &str,
    in_force: &BTreeSet<usize>,
    target: &Target,
    fix: String,
) -> Finding {
    let asked = root.command_line_option(option);
    let asked_cores = asked.as_deref().map(cores_of_option).unwrap_or_default();
    let (loops, force) = (list(&target.cores), list(in_force));
    if !asked_cores.is_subset(in_force) {
        let asked = asked.unwrap_or_default();
        return topic.problem(
            format!("{option}={asked} is on the kernel command line, in force is: {force}"),
            format!("dmesg | grep -i {option} says why the kernel refused it; {fix}"),
        );
    }
    if target.cores.is_empty() {
        return topic.advice(format!("{force}; the loop is bound to no core"), fix);
    }
    if target.cores.is_subset(in_force) {
        return topic.ok(format!("{force}, in force"));
    }
    let others: BTreeSet<_> = in_force.difference(&target.cores).copied().collect();
    if others.is_empty() {
        return topic.advice(force, fix);
    }
    topic.advice(
        format!("{force}, in force, but the loop is on {loops}"),
        format!("give the processes core {} under [timing] in the scenario, or {fix}", list(&others)),
    )
}

/// Cores of an option like "domain,managed_irq,2-3": its words that are no numbers are flags.
fn cores_of_option(value: &str) -> BTreeSet<usize> {
    value.split(',').filter_map(parse_cores).flatten().collect()
}

fn smt(root: &Root, target: &Target) -> Finding {
    let active = root.text(&format!("{FOLDER}/smt/active"));
    match active.as_deref() {
        Some("0") if root.is_virtual() => {
            return SMT.unknown(
                "off as far as this virtual machine sees; what shares its cores is the host's secret",
                "ask for cores of one's own, or use a computer without hypervisor",
            );
        }
        Some("0") => return SMT.ok("off, or the processor has none"),
        Some("1") => {}
        _ => return SMT.unknown(format!("{FOLDER}/smt/active can't be read"), ""),
    }
    let mut shared = Vec::new();
    for core in &target.cores {
        let Some(mut siblings) = root.cores(&format!("{FOLDER}/cpu{core}/topology/thread_siblings_list"))
        else {
            return SMT.unknown(format!("the siblings of core {core} can't be read"), "");
        };
        siblings.remove(core);
        if !siblings.is_empty() {
            shared.push(format!("core {core} shares with {}", list(&siblings)));
        }
    }
    if shared.is_empty() {
        return SMT.ok("on, and the loop's cores have no sibling");
    }
    let fix = "switch it off in the firmware, or: echo off > /sys/devices/system/cpu/smt/control";
    SMT.advice(shared.join(", "), fix)
}

//! Interrupts that may land on the loop's cores.

use super::finding::{Finding, Topic};
use super::root::{Root, list};
use super::target::Target;
use std::collections::{BTreeMap, BTreeSet};

const AFFINITY: Topic = Topic {
    id: "irq-affinity",
    what: "interrupts on the loop's cores",
    why: "An interrupt goes before every process. A disk's or a network's under load takes tens of µs at a time.",
};
const BALANCER: Topic = Topic {
    id: "irqbalance",
    what: "irqbalance",
    why: "It moves interrupts about while the machine runs, onto the loop's cores too.",
};

/// Names at most this many interrupts.
const MOST_NAMED: usize = 4;

/// Both.
pub fn look(root: &Root, target: &Target) -> Vec<Finding> {
    vec![affinity(root, target), balancer(root, target)]
}

fn affinity(root: &Root, target: &Target) -> Finding {
    let Some(all) = handlers(root) else {
        return AFFINITY.unknown("/proc/irq can't be read", "");
    };
    let counts = counts(root, target);
    let mut landing = Vec::new();
    let mut unreadable = 0;
    for Interrupt { number, handler, cores } in all {
        match cores {
            None => unreadable += 1,
            Some(cores) if cores.is_disjoint(&target.cores) => {}
            Some(_) => landing.push((counts.get(&number).copied().unwrap_or(0), number, handler)),
        }
    }
    if landing.is_empty() && unreadable > 0 {
        return AFFINITY
            .unknown(format!("where {unreadable} interrupts go can't be read"), "run this as root");
    }
    if landing.is_empty() {
        return AFFINITY.ok(format!("none on core {}", list(&target.cores)));
    }
    AFFINITY.advice(describe(landing), fix(root, target))
}

/// An interrupt that can come.
pub struct Interrupt {
    /// Its number.
    pub number: String,
    /// Who handles it.
    pub handler: String,
    /// The cores it goes to; `None` where that can't be read.
    pub cores: Option<BTreeSet<usize>>,
}

/// All interrupts with a handler; `None` where they can't be read.
pub fn handlers(root: &Root) -> Option<Vec<Interrupt>> {
    let mut all = Vec::new();
    for number in root.names("/proc/irq")?.into_iter().filter(|name| name.parse::<u32>().is_ok()) {
        let folder = format!("/proc/irq/{number}");
        // The handlers of an interrupt are folders in its folder; without any it can't come.
        let names = root.names(&folder).unwrap_or_default();
        let handler = names.into_iter().find(|name| root.path(&format!("{folder}/{name}")).is_dir());
        let Some(handler) = handler else { continue };
        let effective = root.cores(&format!("{folder}/effective_affinity_list"));
        let cores = effective
            .filter(|cores| !cores.is_empty())
            .or_else(|| root.cores(&format!("{folder}/smp_affinity_list")));
        all.push(Interrupt { number, handler, cores });
    }
    Some(all)
}

/// The busiest first.
fn describe(mut landing: Vec<(u64, String, String)>) -> String {
    landing.sort_by(|a, b| b.cmp(a));
    let all = landing.len();
    let named = landing.into_iter().take(MOST_NAMED);
    let texts: Vec<_> =
        named.map(|(count, number, handler)| format!("{number} {handler} ({count} times so far)")).collect();
    let rest = if all > MOST_NAMED { format!(", and {} more", all - MOST_NAMED) } else { String::new() };
    format!("{all}: {}{rest}", texts.join(", "))
}

fn fix(root: &Root, target: &Target) -> String {
    let online = root.cores("/sys/devices/system/cpu/online").unwrap_or_default();
    let others = online.difference(&target.cores).copied().collect();
    format!(
        "irqaffinity={0} on the kernel command line (rt-config/kernel); now: echo {0} > /proc/irq/NUMBER/smp_affinity_list \
         (some refuse: they belong to a core)",
        list(&others)
    )
}

/// How often each interrupt came on the loop's cores since boot.
fn counts(root: &Root, target: &Target) -> BTreeMap<String, u64> {
    let text = root.text("/proc/interrupts").unwrap_or_default();
    let mut lines = text.lines();
    let columns: Vec<usize> = lines.next().map_or_else(Vec::new, |header| {
        header
            .split_whitespace()
            .filter_map(|name| name.strip_prefix("CPU").and_then(|core| core.parse().ok()))
            .collect()
    });
    let count = |line: &str| {
        let (number, rest) = line.split_once(':')?;
        let counts = rest.split_whitespace().zip(&columns);
        let ours = counts.filter(|(_, core)| target.cores.contains(core));
        Some((number.trim().to_owned(), ours.filter_map(|(count, _)| count.parse::<u64>().ok()).sum()))
    };
    lines.filter_map(count).collect()
}

fn balancer(root: &Root, target: &Target) -> Finding {
    let Some(processes) = root.names("/proc") else {
        return BALANCER.unknown("/proc can't be read", "");
    };
    let numbers = processes.iter().filter(|name| name.parse::<u32>().is_ok());
    let mut names = numbers.filter_map(|number| root.text(&format!("/proc/{number}/comm"))).peekable();
    if names.peek().is_none() {
        return BALANCER.unknown("no process can be seen", "");
    }
    if names.any(|name| name == "irqbalance") {
        let fix = format!(
            "IRQBALANCE_BANNED_CPULIST={} in /etc/default/irqbalance, or remove irqbalance",
            list(&target.cores)
        );
        return BALANCER.advice("runs", fix);
    }
    BALANCER.ok("does not run")
}

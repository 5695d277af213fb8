//! What this user may ask of the kernel: priorities, locked memory, and how much time real-time work may take.

use super::finding::{Finding, Topic};
use super::root::Root;
use super::target::Target;

const THROTTLE: Topic = Topic {
    id: "sched-rt-runtime",
    what: "share of real-time work",
    why: "Beyond this share of each second the kernel holds real-time processes back. A loop that sleeps in every cycle \
          stays far below it.",
};
const PRIORITY: Topic = Topic {
    id: "rtprio",
    what: "real-time priority",
    why: "Without SCHED_FIFO every other program on the core has its turn before the loop, for milliseconds.",
};
const MEMORY: Topic = Topic {
    id: "memlock",
    what: "locked memory",
    why: "Memory that is not locked may have to be fetched in the middle of a cycle.",
};
const CAPABILITIES: Topic = Topic {
    id: "capabilities",
    what: "capabilities",
    why: "CAP_SYS_NICE and CAP_IPC_LOCK stand for the two limits above. A service should have the limits and no more.",
};

/// Bits of a capability set.
const CAP_IPC_LOCK: u32 = 14;
const CAP_SYS_NICE: u32 = 23;
/// What the processes of a loop lock each, with room: `bench sim` shows what it is.
const LOCKED_BYTES: u64 = 256 << 20;

/// All four.
pub fn look(root: &Root, target: &Target) -> Vec<Finding> {
    vec![throttle(root), priority(root, target), memory(root), capabilities(root)]
}

fn throttle(root: &Root) -> Finding {
    let read = |name: &str| root.text(&format!("/proc/sys/kernel/{name}"))?.parse::<i64>().ok();
    let (Some(runtime_us), Some(period_us)) = (read("sched_rt_runtime_us"), read("sched_rt_period_us"))
    else {
        return THROTTLE.unknown("/proc/sys/kernel/sched_rt_runtime_us can't be read", "");
    };
    let fix = "sysctl -w kernel.sched_rt_runtime_us=950000; for good: rt-config/sysctl.d/60-stepvalve.conf";
    match runtime_us {
        -1 => THROTTLE.advice("unlimited: a process that spins by mistake can't be stopped any more", fix),
        0 => THROTTLE.problem("none at all (sched_rt_runtime_us = 0)", fix).blocking(),
        _ if runtime_us * 2 < period_us => THROTTLE.problem(format!("{runtime_us} of {period_us} µs"), fix),
        _ => THROTTLE.ok(format!("{runtime_us} of {period_us} µs")),
    }
}

fn priority(root: &Root, target: &Target) -> Finding {
    let Some(wanted) = target.priority else {
        return PRIORITY.advice(
            "the scenario asks for none",
            "priority = 80 under [timing.plant-simulator] and its like",
        );
    };
    if capability(root, CAP_SYS_NICE) == Some(true) {
        return PRIORITY.ok(format!("{wanted} may be asked for (CAP_SYS_NICE)"));
    }
    let fix = "rt-config/limits.d/60-stepvalve.conf for users, LimitRTPRIO= in the unit for a service";
    match limit(root, "Max realtime priority") {
        Some(limit) if limit >= u64::from(wanted) => PRIORITY.ok(format!("{wanted} may be asked for")),
        Some(limit) => {
            let found = format!("the limit is {limit} (ulimit -r), the loop asks for {wanted}");
            PRIORITY.problem(found, fix).blocking()
        }
        None => PRIORITY.unknown("/proc/self/limits can't be read", ""),
    }
}

fn memory(root: &Root) -> Finding {
    if capability(root, CAP_IPC_LOCK) == Some(true) {
        return MEMORY.ok("unlimited (CAP_IPC_LOCK)");
    }
    let fix =
        "rt-config/limits.d/60-stepvalve.conf for users, LimitMEMLOCK=infinity in the unit for a service";
    match limit(root, "Max locked memory") {
        Some(u64::MAX) => MEMORY.ok("unlimited"),
        Some(bytes) if bytes >= LOCKED_BYTES => MEMORY.ok(format!("{} MB", bytes >> 20)),
        Some(bytes) => MEMORY.problem(
            format!("the limit is {} kB (ulimit -l), wanted are {} MB", bytes >> 10, LOCKED_BYTES >> 20),
            fix,
        ),
        None => MEMORY.unknown("/proc/self/limits can't be read", ""),
    }
}

fn capabilities(root: &Root) -> Finding {
    let (Some(nice), Some(lock)) = (capability(root, CAP_SYS_NICE), capability(root, CAP_IPC_LOCK)) else {
        return CAPABILITIES.unknown("/proc/self/status can't be read", "");
    };
    let status = root.text("/proc/self/status").unwrap_or_default();
    let effective_uid = status
        .lines()
        .find_map(|line| line.strip_prefix("Uid:")?.split_whitespace().nth(1)?.parse::<u32>().ok());
    let has = |there: bool| if there { "yes" } else { "no" };
    let found = format!("CAP_SYS_NICE: {}, CAP_IPC_LOCK: {}", has(nice), has(lock));
    match effective_uid {
        Some(0) => CAPABILITIES.advice(
            format!("{found}; this is root"),
            "run the loop as a user of its own: rt-config/sysusers.d and rt-config/systemd",
        ),
        Some(_) => CAPABILITIES.ok(found),
        None => CAPABILITIES.unknown(format!("{found}; whose process this is can't be read"), ""),
    }
}

/// The soft limit of this process; `u64::MAX` where it is unlimited.
fn limit(root: &Root, name: &str) -> Option<u64> {
    let limits = root.text("/proc/self/limits")?;
    let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
    match line.split_whitespace().next()? {
        "unlimited" => Some(u64::MAX),
        soft => soft.parse().ok(),
    }
}

/// Whether this process has a capability, by its bit.
pub fn capability(root: &Root, bit: u32) -> Option<bool> {
    let status = root.text("/proc/self/status")?;
    let set = status.lines().find_map(|line| line.strip_prefix("CapEff:"))?;
    let set = u64::from_str_radix(set.trim(), 16).ok()?;
    Some(set & (1 << bit) != 0)
}

//! The kernel: can it be interrupted, how fine are its timers, what does it read the time from.

use super::finding::{Finding, Topic};
use super::root::Root;
use nix::time::{ClockId, clock_getres};

const PREEMPTION: Topic = Topic {
    id: "preemption",
    what: "kernel preemption",
    why: "While the kernel works for another program and can't be interrupted, a process whose deadline has come \
          waits: milliseconds in the worst case without PREEMPT_RT, some 100 µs with it.",
};
const TIMERS: Topic = Topic {
    id: "high-resolution-timers",
    what: "high-resolution timers",
    why: "Without them every sleep ends with the next tick, up to 10 ms late.",
};
const CLOCK_SOURCE: Topic = Topic {
    id: "clock-source",
    what: "clock source",
    why: "Every cycle reads the clock several times. Read from the processor that takes 20 to 50 ns; read from a \
          chip beside it 1 µs or more, with a system call each time.",
};

/// Sources that the processor itself has, which the vDSO reads without a system call.
const FAST_SOURCES: [&str; 4] = ["tsc", "arch_sys_counter", "kvm-clock", "hyperv_clocksource_tsc_page"];
/// Sources known to be slow.
const SLOW_SOURCES: [&str; 5] = ["hpet", "acpi_pm", "jiffies", "pit", "refined-jiffies"];

/// All three.
pub fn look(root: &Root) -> Vec<Finding> {
    vec![preemption(root), timers(root), clock_source(root)]
}

fn preemption(root: &Root) -> Finding {
    let fix = "install a PREEMPT_RT kernel (Debian: linux-image-rt-amd64; Ubuntu: linux-image-realtime)";
    if root.text("/sys/kernel/realtime").as_deref() == Some("1") {
        return PREEMPTION.ok("PREEMPT_RT");
    }
    let Some(version) = root.text("/proc/version") else {
        return PREEMPTION.unknown("/proc/version can't be read", "");
    };
    let has = |word: &str| version.split_whitespace().any(|found| found == word);
    if has("PREEMPT_RT") {
        PREEMPTION.ok("PREEMPT_RT")
    } else if has("PREEMPT_DYNAMIC") {
        let mode = dynamic_mode(root)
            .map_or("which mode is unknown: /sys/kernel/debug/sched/preempt".to_owned(), |mode| {
                format!("mode {mode}")
            });
        let until_then = "; until then preempt=full on the kernel command line";
        PREEMPTION.advice(format!("not PREEMPT_RT: PREEMPT_DYNAMIC, {mode}"), fix.to_owned() + until_then)
    } else if has("PREEMPT") {
        PREEMPTION.advice("not PREEMPT_RT: PREEMPT (full, without threaded interrupts)", fix)
    } else {
        PREEMPTION.advice("not PREEMPT_RT: the kernel can't be interrupted within a system call", fix)
    }
}

/// The mode chosen of a kernel that has several: the one in parentheses, or what the command line asks for.
fn dynamic_mode(root: &Root) -> Option<String> {
    let modes = root.text("/sys/kernel/debug/sched/preempt");
    let chosen = modes.as_deref().and_then(|modes| {
        modes.split_whitespace().find_map(|mode| mode.strip_prefix('(')?.strip_suffix(')'))
    });
    let asked = || root.command_line_option("preempt").map(|mode| mode + " (as the command line asks)");
    chosen.map(str::to_owned).or_else(asked)
}

fn timers(root: &Root) -> Finding {
    let fix = "boot without highres=off and nohz=off, with a kernel that has CONFIG_HIGH_RES_TIMERS";
    let refused = |asked: &str| root.command_line_option(asked).as_deref() == Some("off");
    // The list is root's; the clock's resolution says the same to everybody, of the machine that it is asked on.
    if let Some(list) = root.text("/proc/timer_list") {
        let active: Vec<_> =
            list.lines().filter_map(|line| line.trim().strip_prefix(".hres_active")).collect();
        return match active.iter().filter(|line| !line.trim_end().ends_with('1')).count() {
            _ if active.is_empty() => TIMERS.unknown("/proc/timer_list does not say", ""),
            0 => TIMERS.ok("active on every core"),
            cores => TIMERS.problem(format!("not active on {cores} cores"), fix).blocking(),
        };
    }
    let resolution_ns = root
        .is_machine()
        .then(|| clock_getres(ClockId::CLOCK_MONOTONIC).ok())
        .flatten()
        .map(|time| time.tv_sec() * 1_000_000_000 + time.tv_nsec());
    match resolution_ns {
        Some(1) => TIMERS.ok("active (the clock's resolution is 1 ns)"),
        Some(ns) => TIMERS.problem(format!("the clock's resolution is {ns} ns"), fix).blocking(),
        None if refused("highres") => {
            TIMERS.problem("refused on the kernel command line (highres=off)", fix).blocking()
        }
        None => TIMERS.unknown("/proc/timer_list can't be read", "run this as root"),
    }
}

fn clock_source(root: &Root) -> Finding {
    let folder = "/sys/devices/system/clocksource/clocksource0";
    let Some(source) = root.text(&format!("{folder}/current_clocksource")) else {
        return CLOCK_SOURCE.unknown(format!("{folder}/current_clocksource can't be read"), "");
    };
    if FAST_SOURCES.contains(&source.as_str()) {
        return CLOCK_SOURCE.ok(source);
    }
    let available = root.text(&format!("{folder}/available_clocksource")).unwrap_or_default();
    let better = FAST_SOURCES.iter().find(|fast| available.split_whitespace().any(|name| name == **fast));
    let fix = match better {
        Some(better) => {
            format!("echo {better} > {folder}/current_clocksource; for good: clocksource={better}")
        }
        None => "none better is offered: dmesg | grep -i clocksource says why (often a TSC found unstable; \
                 the firmware's settings, or tsc=reliable where the processor is known to be good)"
            .to_owned(),
    };
    if SLOW_SOURCES.contains(&source.as_str()) {
        CLOCK_SOURCE.problem(source, fix)
    } else {
        CLOCK_SOURCE.unknown(format!("{source} is not one that this program knows"), "")
    }
}

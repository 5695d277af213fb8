//! What the processor saves while it may: clock frequency and idle states.

use super::finding::{Finding, Topic};
use super::root::Root;
use super::target::Target;
use std::fs::OpenOptions;

const GOVERNOR: Topic = Topic {
    id: "governor",
    what: "frequency governor",
    why: "A governor that lowers the clock while the core is idle lets every cycle begin slowly.",
};
const IDLE_STATES: Topic = Topic {
    id: "idle-states",
    what: "idle states (C-states)",
    why: "A core that sleeps deeply needs up to several 100 µs to wake; the loop sleeps in every cycle.",
};

/// An exit latency that a 1 kHz loop doesn't feel, µs.
const SHALLOW_US: u64 = 10;

/// Both.
pub fn look(root: &Root, target: &Target) -> Vec<Finding> {
    vec![governor(root, target), idle_states(root, target)]
}

fn governor(root: &Root, target: &Target) -> Finding {
    let of = |core: &usize| {
        root.text(&format!("/sys/devices/system/cpu/cpu{core}/cpufreq/scaling_governor"))
            .map(|governor| (*core, governor))
    };
    let governors: Vec<_> = target.cores.iter().filter_map(of).collect();
    if governors.len() < target.cores.len() || governors.is_empty() {
        return GOVERNOR.unknown(
            "the kernel does not govern this core's frequency: firmware or hypervisor do, or nobody",
            "look into the firmware's settings",
        );
    }
    let others: Vec<_> = governors.iter().filter(|(_, governor)| governor != "performance").collect();
    if others.is_empty() {
        return GOVERNOR.ok("performance");
    }
    let texts: Vec<_> = others.iter().map(|(core, governor)| format!("core {core}: {governor}")).collect();
    let fix = "cpupower frequency-set --governor performance, or the tuned profile in rt-config/tuned";
    GOVERNOR.problem(texts.join(", "), fix)
}

/// An idle state that the kernel may choose.
struct IdleState {
    name: String,
    exit_latency_us: u64,
}

fn idle_states(root: &Root, target: &Target) -> Finding {
    let mut deepest: Option<IdleState> = None;
    for core in &target.cores {
        let Some(states) = states_of(root, *core) else {
            return IDLE_STATES.unknown(
                format!("the kernel manages no idle states of core {core}: firmware or hypervisor may"),
                "look into the firmware's settings; the measurement below shows what it costs",
            );
        };
        let deeper = states.into_iter().max_by_key(|state| state.exit_latency_us);
        deepest = deepest.into_iter().chain(deeper).max_by_key(|state| state.exit_latency_us);
    }
    let Some(deepest) = deepest else { return IDLE_STATES.unknown("the loop is bound to no core", "") };
    let found = format!("{}, {} µs to wake", deepest.name, deepest.exit_latency_us);
    if root.is_virtual() {
        return IDLE_STATES.unknown(
            format!("the deepest that this virtual machine sees: {found}; the host has its own"),
            "the measurement below shows what it costs",
        );
    }
    if deepest.exit_latency_us <= SHALLOW_US {
        return IDLE_STATES.ok(format!("the deepest allowed: {found}"));
    }
    // Opening it asks for nothing yet; the loop writes 0 and keeps it open.
    let may_hold = OpenOptions::new().write(true).open(root.path("/dev/cpu_dma_latency"));
    match may_hold {
        Ok(_) => IDLE_STATES.ok(format!(
            "{found}; this user may hold /dev/cpu_dma_latency, so the loop keeps to the shallow ones"
        )),
        Err(error) => IDLE_STATES.problem(
            format!("the deepest allowed: {found}, and /dev/cpu_dma_latency: {error}"),
            "rt-config/udev/60-stepvalve.rules gives the group stepvalve access",
        ),
    }
}

/// The states that are not disabled; `None` where there is no list.
fn states_of(root: &Root, core: usize) -> Option<Vec<IdleState>> {
    let folder = format!("/sys/devices/system/cpu/cpu{core}/cpuidle");
    let names = root.names(&folder)?;
    let state = |name: &String| {
        let read = |file: &str| root.text(&format!("{folder}/{name}/{file}"));
        let exit_latency_us = read("latency")?.parse().ok()?;
        (read("disable").as_deref() != Some("1"))
            .then(|| IdleState { name: read("name").unwrap_or_default(), exit_latency_us })
    };
    let states: Vec<_> = names.iter().filter(|name| name.starts_with("state")).filter_map(state).collect();
    (!states.is_empty()).then_some(states)
}

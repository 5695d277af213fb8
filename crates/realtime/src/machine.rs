//! The facts of the machine that a run was made on, as its kernel tells them.

use std::fs::read_to_string;

/// Name and value of each fact; "unknown" where the kernel doesn't tell.
pub fn machine_facts() -> Vec<(String, String)> {
    let cpu_field = |name: &str| {
        let text = read_to_string("/proc/cpuinfo").unwrap_or_default();
        let line = text.lines().find(|line| line.starts_with(name)).and_then(|line| line.split_once(':'));
        line.map_or_else(unknown, |(_, value)| value.trim().to_owned())
    };
    let cores = std::thread::available_parallelism().map_or_else(|_| unknown(), |count| count.to_string());
    let facts = [
        ("kernel", first_line("/proc/version")),
        ("cpu", cpu_field("model name")),
        ("cores", cores),
        ("preempt_rt", preempt_rt()),
        ("isolated_cores", first_line("/sys/devices/system/cpu/isolated")),
        ("governor", first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")),
        ("clock_source", first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource")),
        ("sched_rt_runtime_us", first_line("/proc/sys/kernel/sched_rt_runtime_us")),
        ("command_line", first_line("/proc/cmdline")),
    ];
    facts.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

fn unknown() -> String {
    "unknown".to_owned()
}

fn first_line(path: &str) -> String {
    read_to_string(path)
        .map_or_else(|_| unknown(), |text| text.lines().next().unwrap_or_default().trim().to_owned())
}

fn preempt_rt() -> String {
    // The file is there on PREEMPT_RT kernels alone.
    if first_line("/sys/kernel/realtime") == "1" { "yes".to_owned() } else { "no".to_owned() }
}

//! cyclictest as the peer: as many threads as the loop has processes, with their core, priorities and offsets.

use crate::programs::{LOOP, Workplace, installed};
use crate::scenario::Variant;
use crate::timing::Times;
use anyhow::{Context, Result, bail};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::process::{Child, Command, Stdio};

/// Wake-ups later than this are counted by their number, and taken as late as the latest one, ns.
const HISTOGRAM_NS: u64 = 500_000;

#[derive(Deserialize)]
struct Output {
    thread: BTreeMap<String, Thread>,
}

#[derive(Deserialize)]
struct Thread {
    histogram: BTreeMap<String, u64>,
    cycles: u64,
    max: u64,
}

/// Whether there is one.
pub fn there() -> bool {
    installed("cyclictest")
}

/// Wake-up latencies of as many threads, in the order of their offsets.
///
/// # Errors
/// Where cyclictest fails, or writes something else than expected.
pub fn run(place: &Workplace, variant: &Variant, core: usize, priority: u8) -> Result<Vec<Times>> {
    let mut command = command(place, "together", variant, core, priority);
    // One thread more than offsets would shift nothing: thread i begins i times `aligned` after the first.
    command.args(["--priospread", "--distance=0", "--threads", &LOOP.len().to_string()]);
    command.arg(format!("--aligned={}", variant.spacing_ns() / 1000));
    threads_of(place, "together", started(command)?, LOOP.len())
}

/// The same with a process for each thread, as the loop has.
///
/// # Errors
/// As [`run`].
pub fn run_apart(place: &Workplace, variant: &Variant, core: usize, priority: u8) -> Result<Vec<Times>> {
    let names: Vec<String> = (0..LOOP.len()).map(|index| format!("apart-{index}")).collect();
    let mut running = Vec::new();
    for (index, name) in (0_u8..).zip(&names) {
        let mut command = command(place, name, variant, core, priority - index);
        let offset_ns = u64::from(index) * variant.spacing_ns();
        command.args(["--threads=1", &format!("--secaligned={}", offset_ns / 1000)]);
        running.push(started(command)?);
    }
    let mut all = Vec::new();
    for (name, process) in names.iter().zip(running) {
        all.extend(threads_of(place, name, process, 1)?);
    }
    Ok(all)
}

fn command(place: &Workplace, name: &str, variant: &Variant, core: usize, priority: u8) -> Command {
    let mut command = Command::new("cyclictest");
    command
        .args(["--quiet", "--mlockall", "--nsecs", "--policy=fifo", "--affinity", &core.to_string()])
        .arg(format!("--priority={priority}"))
        .arg(format!("--interval={}", variant.period_ns / 1000))
        .arg(format!("--loops={}", variant.cycles))
        .arg(format!("--histogram={HISTOGRAM_NS}"))
        .arg(format!("--histfile={}", place.path(&format!("{name}.histogram")).display()))
        .arg(format!("--json={}", place.path(&format!("{name}.json")).display()))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    command
}

fn started(mut command: Command) -> Result<Child> {
    command.spawn().context("cyclictest")
}

fn threads_of(place: &Workplace, name: &str, process: Child, count: usize) -> Result<Vec<Times>> {
    let output = process.wait_with_output().context("cyclictest")?;
    if !output.status.success() {
        bail!("cyclictest: {}: {}", output.status, String::from_utf8_lossy(&output.stderr).trim());
    }
    let json = std::fs::read_to_string(place.path(&format!("{name}.json"))).context("cyclictest's JSON")?;
    read(&json, count)
}

fn read(json: &str, count: usize) -> Result<Vec<Times>> {
    let output: Output = serde_json::from_str(json).context("cyclictest's JSON")?;
    let threads = (0..count).map(|index| {
        let thread = output.thread.get(&index.to_string()).with_context(|| format!("thread {index}"))?;
        let mut times = Times::new()?;
        for (time_ns, count) in &thread.histogram {
            times.add_bins([(time_ns.parse().context("a bin of cyclictest's histogram")?, *count)]);
        }
        times.add_bins([(thread.max, thread.cycles.saturating_sub(times.count()))]);
        Ok(times)
    });
    threads.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wake_ups_beyond_its_histogram_are_counted() {
        let thread = r#"{"histogram": {"2000": 90, "3000": 8}, "cycles": 100, "max": 700000}"#;
        let json = format!(r#"{{"thread": {{"0": {thread}, "1": {thread}, "2": {thread}}}}}"#);
        let threads = read(&json, 3).unwrap();
        assert_eq!(threads.len(), 3);
        assert_eq!(threads[0].count(), 100);
        assert!(threads[0].max_ns().abs_diff(700_000) < 7_000);
    }
}

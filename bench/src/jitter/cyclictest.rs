//! cyclictest as the peer: as many threads as the loop has processes, with their core, priorities and offsets.

use crate::programs::{LOOP, Workplace, installed};
use crate::scenario::Variant;
use crate::timing::Times;
use anyhow::{Context, Result, bail};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::process::{Command, Stdio};

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
    let json = place.path("cyclictest.json");
    let cycles = variant.cycles.to_string();
    let output = Command::new("cyclictest")
        // One thread more than offsets would shift nothing: thread i begins i times `aligned` after the first.
        .args(["--quiet", "--mlockall", "--nsecs", "--priospread", "--policy=fifo"])
        .args(["--threads", &LOOP.len().to_string(), "--affinity", &core.to_string()])
        .arg(format!("--priority={priority}"))
        .arg(format!("--interval={}", variant.period_ns / 1000))
        .arg("--distance=0")
        .arg(format!("--aligned={}", variant.spacing_ns() / 1000))
        .arg(format!("--loops={cycles}"))
        .arg(format!("--histogram={HISTOGRAM_NS}"))
        .arg(format!("--histfile={}", place.path("cyclictest.histogram").display()))
        .arg(format!("--json={}", json.display()))
        .stdin(Stdio::null())
        .output()
        .context("cyclictest")?;
    if !output.status.success() {
        bail!("cyclictest: {}: {}", output.status, String::from_utf8_lossy(&output.stderr).trim());
    }
    read(&std::fs::read_to_string(&json).context("cyclictest's JSON")?)
}

fn read(json: &str) -> Result<Vec<Times>> {
    let output: Output = serde_json::from_str(json).context("cyclictest's JSON")?;
    let threads = (0..LOOP.len()).map(|index| {
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
        let threads = read(&json).unwrap();
        assert_eq!(threads.len(), 3);
        assert_eq!(threads[0].count(), 100);
        assert!(threads[0].max_ns().abs_diff(700_000) < 7_000);
    }
}

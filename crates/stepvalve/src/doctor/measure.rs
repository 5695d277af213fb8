//! How late a process of the loop's priority wakes on the loop's core: with cyclictest where it is installed, else
//! with the loop's own timer.

use super::target::Target;
use crate::pulse::Pulse;
use anyhow::{Context, Result, anyhow, bail};
use hdrhistogram::Histogram;
use indicatif::{ProgressBar, ProgressStyle};
use processes::complain;
use realtime::{CyclicTimer, Wanted, now_ns, obtain};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use supervisor::Failure;

/// The longest wake-up told apart, ns.
const LONGEST_NS: u64 = 100_000_000_000;
/// The first wake-ups fill caches.
const WARM_UP: u64 = 20;

/// What was measured.
#[derive(Debug, Clone, Serialize)]
pub struct Measurement {
    /// With what: "cyclictest" or "built-in".
    pub with: &'static str,
    /// The scheduling really had, in words.
    pub scheduling: String,
    /// Wake-ups.
    pub wake_ups: u64,
    /// Half of them were at most this late, ns.
    pub p50_ns: u64,
    /// 99 of 100.
    pub p99_ns: u64,
    /// 999 of 1000.
    pub p999_ns: u64,
    /// All.
    pub max_ns: u64,
    /// Later than the loop tolerates.
    pub late: u64,
}

/// Measures for so long.
///
/// # Errors
/// Where the measurement can't be made at all; a refused priority is no error, but said in `scheduling`.
pub fn measure(target: &Target, duration: Duration) -> Result<Measurement, Failure> {
    let bar = ProgressBar::new(duration.as_millis() as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:20} wake-up latency, {elapsed} of {msg}") {
        bar.set_style(style);
    }
    bar.set_message(format!("{} s", duration.as_secs_f64()));
    let pulse = Pulse::new(move || format!("measuring wake-up latency, of {} s", duration.as_secs_f64()));
    let result = match cyclictest(target, duration, &bar) {
        Ok(Some(measured)) => Ok(measured),
        Ok(None) => built_in(target, duration, &bar),
        Err(error) => {
            bar.suspend(|| complain(format_args!("note: {error:#}; measuring with the loop's own timer")));
            built_in(target, duration, &bar)
        }
    };
    drop(pulse);
    bar.finish_and_clear();
    Ok(result?)
}

fn histogram() -> Result<Histogram<u64>> {
    Histogram::new_with_bounds(1, LONGEST_NS, 3).map_err(|error| anyhow!("histogram: {error}"))
}

fn summarize(
    with: &'static str,
    scheduling: String,
    latencies: &Histogram<u64>,
    target: &Target,
) -> Measurement {
    let late = latencies.iter_recorded().filter(|bin| bin.value_iterated_to() > target.tolerated_ns);
    Measurement {
        with,
        scheduling,
        wake_ups: latencies.len(),
        p50_ns: latencies.value_at_quantile(0.5),
        p99_ns: latencies.value_at_quantile(0.99),
        p999_ns: latencies.value_at_quantile(0.999),
        max_ns: latencies.max(),
        late: late.map(|bin| bin.count_at_value()).sum(),
    }
}

/// The loop's own timer, in a thread that asks for what the loop asks for.
fn built_in(target: &Target, duration: Duration, bar: &ProgressBar) -> Result<Measurement> {
    let wanted = Wanted { priority: target.priority, core: target.core(), lock_memory: true };
    let period_ns = target.period_ns;
    let cycles = u64::try_from(duration.as_nanos() / u128::from(period_ns))?.max(1);
    let mut latencies = histogram()?;
    let thread = std::thread::spawn(move || {
        let (obtained, _held) = obtain(&wanted);
        let mut timer = CyclicTimer::new(now_ns() + period_ns, period_ns, 0);
        let mut cycle = 0;
        while cycle < WARM_UP + cycles {
            let wake = timer.wait();
            cycle = wake.cycle;
            if cycle >= WARM_UP {
                latencies.saturating_record(wake.latency_ns());
            }
        }
        (obtained, latencies)
    });
    while !thread.is_finished() {
        bar.set_position(bar.elapsed().as_millis() as u64);
        std::thread::sleep(Duration::from_millis(50));
    }
    let (obtained, latencies) = thread.join().map_err(|_| anyhow!("the measurement died"))?;
    let policy =
        obtained.priority.map_or("SCHED_OTHER".to_owned(), |priority| format!("SCHED_FIFO {priority}"));
    let core = obtained.core.map_or("any core".to_owned(), |core| format!("core {core}"));
    let refused: String = obtained.refused.iter().map(|what| format!("; refused: {what}")).collect();
    Ok(summarize("built-in", format!("{policy}, {core}{refused}"), &latencies, target))
}

#[derive(Deserialize)]
struct Output {
    thread: BTreeMap<String, Thread>,
}

/// cyclictest's own words.
#[derive(Deserialize)]
struct Thread {
    histogram: BTreeMap<String, u64>,
    cycles: u64,
    max: u64,
}

/// `None` where it is not installed, or where there is nothing to hand it.
fn cyclictest(target: &Target, duration: Duration, bar: &ProgressBar) -> Result<Option<Measurement>> {
    let (Some(core), Some(priority)) = (target.core(), target.priority) else { return Ok(None) };
    let period_us = target.period_ns / 1000;
    let cycles = duration.as_micros() / u128::from(period_us);
    let spawned = Command::new("cyclictest")
        .args(["--quiet", "--mlockall", "--policy=fifo", "--threads=1"])
        // In µs, and of no more than 5 ms: what is later is counted, and as late as the latest.
        .args(["--histogram=5000", "--histfile=/dev/null", "--json=/dev/stdout"])
        .arg(format!("--priority={priority}"))
        .arg(format!("--affinity={core}"))
        .arg(format!("--interval={period_us}"))
        .arg(format!("--loops={}", cycles.max(1)))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let child = match spawned {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        spawned => spawned.context("cyclictest")?,
    };
    let text = finish(child, duration, bar)?;
    read_cyclictest(&text, core, target).context("cyclictest's JSON").map(Some)
}

fn finish(mut child: Child, duration: Duration, bar: &ProgressBar) -> Result<String> {
    let begun = Instant::now();
    while child.try_wait()?.is_none() {
        if begun.elapsed() > duration * 3 + Duration::from_secs(10) {
            child.kill()?;
            child.wait()?;
            bail!("cyclictest did not end");
        }
        bar.set_position(bar.elapsed().as_millis() as u64);
        std::thread::sleep(Duration::from_millis(50));
    }
    let output = child.wait_with_output()?;
    if !output.status.success() {
        bail!("cyclictest: {}", String::from_utf8_lossy(&output.stderr).trim().replace('\n', "; "));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn read_cyclictest(text: &str, core: usize, target: &Target) -> Result<Measurement> {
    // Some versions print a line behind it.
    let mut values = serde_json::Deserializer::from_str(text).into_iter::<Output>();
    let output = values.next().context("nothing")??;
    let thread = output.thread.get("0").context("no thread 0")?;
    let mut latencies = histogram()?;
    for (us, count) in &thread.histogram {
        latencies.saturating_record_n(us.parse::<u64>()? * 1000, *count);
    }
    let beyond = thread.cycles.saturating_sub(latencies.len());
    latencies.saturating_record_n(thread.max * 1000, beyond);
    // It fails where it does not get what it asks for.
    let priority = target.priority.map_or("?".to_owned(), |priority| priority.to_string());
    Ok(summarize("cyclictest", format!("SCHED_FIFO {priority}, core {core}"), &latencies, target))
}

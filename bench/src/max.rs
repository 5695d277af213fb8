//! `bench max`: the shortest period at which the loop misses no more than what the machine itself takes.

use crate::jitter::witness::{Seen, Witness};
use crate::jitter::{load::LOADS, measure::CORE};
use crate::output::{Results, Sheet, us};
use crate::programs::{LOOP, RunSummary, Workplace, scheduling};
use crate::progress::Progress;
use crate::scenario::Variant;
use anyhow::Result;
use serde_json::{Value, json};

/// Periods, ns, from the longest; a scenario's shortest is 100 µs.
const PERIODS_NS: [u64; 7] = [1_000_000, 500_000, 333_000, 250_000, 200_000, 150_000, 100_000];

/// Runs the loop at each period, idle, with a witness of lowest priority on its core.
///
/// # Errors
/// Where a run fails.
pub fn run(quick: bool) -> Result<Results> {
    let cycles = if quick { 3_000 } else { 100_000 };
    let progress = Progress::new(PERIODS_NS.len());
    let place = Workplace::new()?;
    let title = format!(
        "{cycles} cycles at each period, {}: missed cycles of the process that missed most, beside the times that the \
         core stood still for half a period or longer while a witness of lowest priority had it",
        LOADS.first().map_or("idle", |load| load.name)
    );
    let header = ["period, µs", "missed", "occasions", "stalls seen", "longest stall, µs", "holds"];
    let mut sheet = Sheet::new("max", title, &header);
    let (mut data, mut obtained) = (Vec::new(), String::new());
    let mut shortest = None;
    for period_ns in PERIODS_NS {
        progress.next(format!("{} µs", period_ns / 1000));
        let scenario = place.path("max.toml");
        Variant { period_ns, cycles, seed: 2, early_ns: 0 }.write(&scenario)?;
        let witness = Witness::on(CORE);
        let summary = place.simulate(&scenario, "realtime", &[]);
        let seen = witness.end()?;
        let summary = summary?;
        obtained = scheduling(&summary);
        let (row, value, holds) = judged(period_ns, &summary, &seen);
        sheet.row(row);
        data.push(value);
        if holds {
            shortest = Some(period_ns);
        } else {
            break;
        }
    }
    Ok(Results {
        command: "max",
        quick,
        machine: realtime::machine_facts(),
        scheduling: obtained,
        sheets: vec![sheet],
        data: json!({"cycles": cycles, "shortest_period_ns": shortest, "periods": data}),
    })
}

fn judged(period_ns: u64, summary: &RunSummary, seen: &Seen) -> (Vec<String>, Value, bool) {
    let timings =
        LOOP.iter().filter_map(|name| summary.processes.get(*name)).map(|process| &process.counts.timing);
    let missed = timings.clone().map(|timing| timing.overruns + timing.skipped_cycles).max().unwrap_or(0);
    let occasions =
        timings.map(|timing| timing.overruns + late_wake_ups(&timing.wake_up_bins, period_ns)).max();
    let occasions = occasions.unwrap_or(0);
    let stalls = seen.stalls.count_over(period_ns / 2);
    let holds = occasions <= stalls;
    let row = [
        (period_ns as f64 / 1e3).to_string(),
        missed.to_string(),
        occasions.to_string(),
        stalls.to_string(),
        us(seen.stalls.max_ns()),
        if holds { "yes" } else { "no" }.to_owned(),
    ];
    let value = json!({
        "period_ns": period_ns, "cycles": summary.cycles, "missed": missed, "occasions": occasions,
        "stalls_over_half_a_period": stalls, "stalls": seen.stalls.json(), "steal_ns": seen.steal_ns, "holds": holds,
    });
    (row.to_vec(), value, holds)
}

/// Wake-ups later than a period: however many cycles each passed over, it is one occasion.
fn late_wake_ups(bins: &[(u64, u64)], period_ns: u64) -> u64 {
    bins.iter().filter(|(latency_ns, _)| *latency_ns > period_ns).map(|(_, count)| count).sum()
}

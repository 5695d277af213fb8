//! Many scenarios in process, over all cores.

use crate::output::{Sheet, digits};
use crate::progress::Progress;
use crate::scenario::Variant;
use anyhow::Result;
use closed_loop::{InProcess, Parts};
use serde_json::{Value, json};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Runs campaigns of each size, each scenario with a seed of its own.
///
/// # Errors
/// Where the scenario is refused.
pub fn run(sizes: &[usize], cycles: u64, progress: &Progress) -> Result<(Sheet, Value)> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let title = format!("In-process campaigns over {cores} cores, {cycles} cycles a scenario");
    let mut sheet =
        Sheet::new("sim-campaign", title, &["scenarios", "threads", "time, s", "times real time"]);
    let mut data = Vec::new();
    for &size in sizes {
        progress.next(format!("campaign of {size}"));
        let variant = |seed: usize| Variant { seed: seed as u64, ..Variant::of_1khz(cycles) }.parts();
        let parts = (0..size).map(variant).collect::<Result<Vec<_>>>()?;
        let threads = cores.min(size);
        let begun = Instant::now();
        let simulated_s = simulate(&parts, threads);
        let wall_s = begun.elapsed().as_secs_f64();
        let times = simulated_s / wall_s;
        sheet.row([size.to_string(), threads.to_string(), digits(wall_s), digits(times)]);
        data.push(json!({"scenarios": size, "threads": threads, "wall_s": wall_s, "times_real_time": times}));
    }
    Ok((sheet, Value::Array(data)))
}

/// Each thread takes the next scenario until none is left; the time simulated, s.
fn simulate(parts: &[Parts], threads: usize) -> f64 {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut simulated_s = 0.0;
        while let Some(parts) = parts.get(next.fetch_add(1, Ordering::Relaxed)) {
            let cycles = InProcess::new(parts).map(std::hint::black_box).count();
            simulated_s += cycles as f64 * parts.timeline.period_s();
        }
        simulated_s
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        threads.into_iter().filter_map(|thread| thread.join().ok()).sum()
    })
}

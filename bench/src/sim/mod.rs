//! `bench sim`: times real time for the three modes, what a cycle costs in each role, and memory of each process.

mod campaign;
mod lockstep;
mod memory;
mod steps;

use crate::output::{Results, Sheet, digits};
use crate::programs::Workplace;
use crate::progress::Progress;
use crate::scenario::Variant;
use anyhow::Result;
use closed_loop::InProcess;
use serde_json::{Value, json};
use std::time::Instant;

/// Runs all of it.
///
/// # Errors
/// Where a program is missing or a run fails.
pub fn run(quick: bool) -> Result<Results> {
    let cycles: &[u64] = if quick { &[1_000, 10_000] } else { &[1_000, 10_000, 100_000, 1_000_000] };
    let process_cycles: &[u64] = if quick { &[1_000, 10_000] } else { &[1_000, 10_000, 50_000, 200_000] };
    let scenarios: &[usize] = if quick { &[1, 4] } else { &[1, 2, 8, 32, 128] };
    let progress = Progress::new(cycles.len() + scenarios.len() + 2 * process_cycles.len() + 2);
    let place = Workplace::new()?;
    let (mut sheets, mut data) = (Vec::new(), serde_json::Map::new());
    let mut take = |name: &str, (sheet, value): (Sheet, Value)| {
        sheets.push(sheet);
        data.insert(name.to_owned(), value);
    };
    take("in_process", in_process(cycles, &progress)?);
    take("campaign", campaign::run(scenarios, if quick { 2_000 } else { 10_000 }, &progress)?);
    take("lockstep", lockstep::run(&place, process_cycles, &progress)?);
    progress.next("the roles' steps");
    take("steps", steps::run(if quick { 50_000 } else { 1_000_000 })?);
    progress.next("memory of each process");
    let (memory, scheduling) = memory::run(&place)?;
    take("memory", memory);
    Ok(Results {
        command: "sim",
        quick,
        machine: realtime::machine_facts(),
        scheduling: format!("the normal scheduler; memory measured under {scheduling}"),
        sheets,
        data: Value::Object(data),
    })
}

/// One thread, no recording: the best of three runs each, since whatever else runs only makes it slower.
fn in_process(cycle_counts: &[u64], progress: &Progress) -> Result<(Sheet, Value)> {
    let header = ["cycles", "time, s", "per cycle, µs", "times real time"];
    let mut sheet =
        Sheet::new("sim-in-process", "In process, one thread, not recorded (1 kHz, rig.toml)", &header);
    let mut data = Vec::new();
    for &cycles in cycle_counts {
        progress.next(format!("in process, {cycles} cycles"));
        let parts = Variant::of_1khz(cycles).parts()?;
        let wall_s = (0..3).map(|_| {
            let begun = Instant::now();
            let run = InProcess::new(&parts).map(std::hint::black_box).count();
            begun.elapsed().as_secs_f64() / run as f64
        });
        let cycle_s = wall_s.fold(f64::INFINITY, f64::min);
        let all = parts.timeline.last_cycle + 1;
        let times = parts.timeline.period_s() / cycle_s;
        sheet.row([all.to_string(), digits(cycle_s * all as f64), digits(cycle_s * 1e6), digits(times)]);
        data.push(json!({"cycles": all, "cycle_s": cycle_s, "times_real_time": times}));
    }
    Ok((sheet, Value::Array(data)))
}

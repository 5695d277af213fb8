//! A day of simulated time in one thread, in quarters: whether anything drifts.

use crate::output::{Results, Sheet};
use crate::progress::Progress;
use crate::scenario::Variant;
use anyhow::{Context, Result};
use closed_loop::{InProcess, Metrics};
use serde_json::json;

/// A day at 1 kHz.
const CYCLES: u64 = 86_400_000;
/// Its parts, each with a line of its own.
const QUARTERS: u64 = 4;

/// Runs it, a thousandth of it where `quick`.
///
/// # Errors
/// Where the shipped scenario can't be used.
pub fn run(quick: bool) -> Result<Results> {
    let cycles = if quick { CYCLES / 1000 } else { CYCLES };
    let header = ["quarter", "cycles", "RMS", "peak", "lost steps", "at a limit", "alarms", "faults"];
    let mut sheet =
        Sheet::new("day", format!("{:.3} hours of simulated time", cycles as f64 / 3.6e6), &header);
    let mut run = InProcess::new(&Variant::of_1khz(cycles).parts()?);
    let progress = Progress::new(QUARTERS as usize);
    for quarter in 1..=QUARTERS {
        progress.next("quarter");
        let mut metrics = Metrics::default();
        let mut count = 0;
        while let Some(outputs) = InProcess::cycle(&mut run) {
            metrics.note_cycle(&outputs);
            count += 1;
            if count == cycles / QUARTERS && quarter < QUARTERS {
                break;
            }
        }
        let error = metrics.true_error().context("the controller never ran")?;
        sheet.row([
            quarter.to_string(),
            count.to_string(),
            format!("{:.3} mrad", error.rms * 1e3),
            format!("{:.3} mrad", error.peak * 1e3),
            metrics.lost_steps.to_string(),
            metrics.limiting_cycles.to_string(),
            if metrics.alarms == 0 { "none".to_owned() } else { format!("{:#x}", metrics.alarms) },
            metrics.fault.map_or("none".to_owned(), |(fault, _)| fault.to_string()),
        ]);
    }
    Ok(Results {
        command: "day",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "no clock".to_owned(),
        sheets: vec![sheet],
        data: json!({ "cycles": cycles }),
    })
}

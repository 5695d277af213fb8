//! Separate processes that wait for each other: unrecorded and recorded.

use crate::output::{Sheet, digits};
use crate::programs::{RunSummary, Workplace};
use crate::progress::Progress;
use crate::scenario::Variant;
use anyhow::Result;
use serde_json::{Value, json};
use std::time::Instant;

/// Runs both for each number of cycles.
///
/// # Errors
/// Where a run fails.
pub fn run(place: &Workplace, cycle_counts: &[u64], progress: &Progress) -> Result<(Sheet, Value)> {
    let header = ["", "cycles", "time, s", "whole command, s", "per cycle, µs", "times real time", "gaps"];
    let title = "Lockstep, four processes; \"per cycle\" and \"times real time\" without the start, \
                 \"whole command\" with start, record and run.h5";
    let mut sheet = Sheet::new("sim-lockstep", title, &header);
    let mut data = Vec::new();
    for (name, options) in [("unrecorded", &["--record", "none"][..]), ("recorded", &[])] {
        // The start takes a fixed time, which the shortest run tells.
        let mut shortest: Option<(u64, RunSummary)> = None;
        for &cycles in cycle_counts {
            progress.next(format!("lockstep {name}, {cycles} cycles"));
            let scenario = place.path("lockstep.toml");
            let variant = Variant::of_1khz(cycles);
            variant.write(&scenario)?;
            let all = variant.parts()?.timeline.last_cycle + 1;
            let begun = Instant::now();
            let run = place.simulate(&scenario, "lockstep", options)?;
            let command_s = begun.elapsed().as_secs_f64();
            let (more_cycles, more_s) = shortest
                .as_ref()
                .map_or((all, run.wall_s), |(first_all, first)| (all - first_all, run.wall_s - first.wall_s));
            // A machine that was busy at the shorter run makes the difference meaningless.
            let cycle_s = if more_s > 0.0 { more_s / more_cycles as f64 } else { f64::NAN };
            let times = run.period_s / cycle_s;
            let gaps = if options.is_empty() {
                (run.declared_missing + run.record_flaws.len() as u64).to_string()
            } else {
                "–".to_owned()
            };
            let numbers = [run.wall_s, command_s, cycle_s * 1e6, times].map(digits);
            sheet.row([name.to_owned(), all.to_string()].into_iter().chain(numbers).chain([gaps]));
            data.push(json!({
                "recorded": options.is_empty(), "cycles": all, "wall_s": run.wall_s, "command_s": command_s,
                "cycle_s": cycle_s, "times_real_time": times, "messages_recorded": run.recorded,
                "declared_missing": run.declared_missing, "record_flaws": run.record_flaws,
            }));
            shortest.get_or_insert((all, run));
        }
    }
    Ok((sheet, Value::Array(data)))
}

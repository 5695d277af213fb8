//! From Feedback k to StepCommand k+1 in the real loop, by the times that the messages themselves carry.

use crate::output::{Sheet, us};
use crate::programs::{Workplace, scheduling};
use crate::scenario::Variant;
use crate::timing::Times;
use anyhow::{Context, Result};
use recording::{AnyMessage, read_record};
use serde_json::{Value, json};
use std::collections::HashMap;

/// Runs the loop for so many cycles and reads its record.
///
/// # Errors
/// Where the run fails or its record can't be read.
pub fn run(cycles: u64) -> Result<(Sheet, Value, String)> {
    let place = Workplace::new()?;
    let (scenario, variant) = (place.path("end-to-end.toml"), Variant::of_1khz(cycles));
    variant.write(&scenario)?;
    let summary = place.simulate(&scenario, "realtime", &[])?;
    let run = place.newest_run().context("the run's folder")?;
    let mut feedback = HashMap::new();
    let (mut whole, mut processing) = (Times::new()?, Times::new()?);
    let mut began = HashMap::new();
    let mut commands = Vec::new();
    read_record(&[run.join("run-0001.mcap")], |message| match message {
        AnyMessage::Feedback(m) => _ = feedback.insert(m.header.cycle, m.header.monotonic_ns),
        AnyMessage::StepCommand(m) => commands.push((m.header.cycle, m.header.monotonic_ns)),
        AnyMessage::LoopTiming(signals::Source::Controller, m) => {
            began.insert(m.header.cycle, m.body.deadline_ns + m.body.wake_up_latency_ns);
        }
        _ => {}
    })?;
    for (cycle, sent_ns) in commands {
        let Some(before) = cycle.checked_sub(1) else { continue };
        feedback.get(&before).into_iter().for_each(|taken_ns| whole.add(sent_ns.saturating_sub(*taken_ns)));
        began.get(&before).into_iter().for_each(|woke_ns| processing.add(sent_ns.saturating_sub(*woke_ns)));
    }
    let title = format!(
        "Feedback k to StepCommand k+1 in the loop at 1 kHz, µs; the controller's phase is {} µs after the plant's",
        2 * variant.spacing_ns() / 1000
    );
    let mut sheet = Sheet::new("bus-end-to-end", title, &["from", "p50", "p99", "p99.9", "max"]);
    for (name, times) in
        [("Feedback sent to StepCommand sent", &whole), ("controller awake to StepCommand sent", &processing)]
    {
        sheet.row([name.to_owned()].into_iter().chain(times.percentiles_ns().map(us)));
    }
    let data = json!({"feedback_to_command": whole.json(), "awake_to_command": processing.json()});
    Ok((sheet, data, scheduling(&summary)))
}

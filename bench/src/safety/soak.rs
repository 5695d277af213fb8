//! A long run beside a load: the valve turns, nothing is done to it, and everything is accounted for.
#![allow(clippy::indexing_slicing, reason = "a key that JSON lacks reads as null")]

use super::live::{Session, ground};
use super::recorded_orders::RecordedOrders;
use crate::jitter::load::LOADS;
use crate::output::{Results, Sheet};
use crate::programs::Workplace;
use anyhow::{Context, Result};
use oracle::Judge;
use recording::{AnyMessage, read_record};
use serde_json::json;
use std::time::{Duration, Instant};

/// Runs it for so many minutes.
///
/// # Errors
/// Where the instance can't be started.
pub fn run(minutes: f64, quick: bool) -> Result<Results> {
    let ground = ground()?;
    let place = Workplace::new()?;
    let load = LOADS.iter().find(|load| load.name == "cpu").context("a load")?;
    let _running = load.start(&place)?;
    let mut session = Session::start(&place, &ground.text, &[])?;
    let begun = Instant::now();
    let mut faults = 0_u64;
    while begun.elapsed().as_secs_f64() < minutes * 60.0 {
        let status = session.status();
        if status.is_some_and(|status| status["state"] == "fault") {
            faults += 1;
        }
        session.turn()?;
        std::thread::sleep(Duration::from_millis(200));
    }
    let status = session.status().unwrap_or_default();
    let ending = session.end()?;
    let mut judge = Judge::new(ground.limits);
    let mut segments: Vec<_> =
        std::fs::read_dir(place.path("record"))?.flatten().map(|entry| entry.path()).collect();
    segments.retain(|path| path.extension().is_some_and(|extension| extension == "mcap"));
    segments.sort();
    let mut orders = RecordedOrders::new(ground.parts.timeline.period_ns);
    let report = read_record(&segments, |message| {
        orders.note(message);
        match message {
            AnyMessage::PlantTruth(m) => judge.truth(m.header.cycle, &m.body),
            AnyMessage::StepCommand(m) => judge.command(m.header.cycle, &m.body),
            _ => {}
        }
    })?;
    orders.put_into(&mut judge);
    let verdict = judge.verdict();
    let mut sheet = Sheet::new("soak", format!("{minutes} minutes beside stress-ng"), &["what", "count"]);
    let sum = |field: &str| -> u64 {
        let processes = status["processes"].as_object();
        processes.into_iter().flatten().filter_map(|(_, process)| process[field].as_u64()).sum()
    };
    for (what, count) in [
        ("minutes", format!("{minutes}")),
        ("cycles", verdict.cycles.to_string()),
        ("pulses", verdict.pulses.to_string()),
        ("unsafe pulses", verdict.findings.len().to_string()),
        ("stops by a fault, each reset and armed again", faults.to_string()),
        ("overruns, all three processes", sum("overruns").to_string()),
        ("skipped cycles, all three processes", sum("skipped_cycles").to_string()),
        ("messages recorded", report.recorded().to_string()),
        ("messages missing in the record, declared", report.missed().to_string()),
        ("complaints at the end", ending.len().to_string()),
    ] {
        sheet.row([what.to_owned(), count]);
    }
    Ok(Results {
        command: "soak",
        quick,
        machine: realtime::machine_facts(),
        scheduling: load.describe(),
        sheets: vec![sheet],
        data: json!({
            "findings": verdict.findings.iter().map(|finding| format!("{finding:?}")).collect::<Vec<_>>(),
            "ending": ending,
        }),
    })
}

//! `bench jitter`: the real loop beside cyclictest, idle and under load, at four periods.

mod apart;
mod cyclictest;
pub mod load;
pub mod measure;
mod page;
mod tables;
pub mod witness;

use crate::output::Results;
use crate::programs::Workplace;
use crate::progress::Progress;
use crate::scenario::Variant;
use anyhow::Result;
use apart::Apart;
use load::LOADS;
use measure::Measured;
use serde_json::json;
use std::path::Path;

/// Periods, ns; the last is shorter than what the product promises.
const PERIODS_NS: [u64; 4] = [1_000_000, 500_000, 250_000, 100_000];

/// Periods at which one process is compared with several, ns.
const COMPARED_NS: [u64; 2] = [1_000_000, 250_000];

/// How much is measured.
struct Extent {
    turns: usize,
    turn_ns: u64,
}

/// Measures everything and writes the page; `turn_s` is the length of a turn where it is not the usual one.
///
/// # Errors
/// Where a run fails.
pub fn run(quick: bool, turn_s: Option<u64>, out: &Path) -> Result<Results> {
    let mut extent = if quick {
        Extent { turns: 2, turn_ns: 500_000_000 }
    } else {
        Extent { turns: 3, turn_ns: 8_000_000_000 }
    };
    extent.turn_ns = turn_s.map_or(extent.turn_ns, |seconds| seconds * 1_000_000_000);
    let loads: Vec<_> = LOADS.into_iter().filter(|load| load.available()).collect();
    let compared: &[u64] = if cyclictest::there() { &COMPARED_NS } else { &[] };
    let steps = (loads.len() * PERIODS_NS.len() * 3 + compared.len()) * extent.turns;
    let progress = Progress::new(steps);
    let place = Workplace::new()?;
    let variant = |period_ns| Variant { period_ns, cycles: extent.turn_ns / period_ns, seed: 2, early_ns: 0 };
    let apart =
        compared.iter().map(|period_ns| Apart::take(&place, &variant(*period_ns), extent.turns, &progress));
    let apart = apart.collect::<Result<Vec<_>>>()?;
    let mut all = Vec::new();
    for load in &loads {
        let _running = load.start(&place)?;
        for period_ns in PERIODS_NS {
            all.push(Measured::take(&place, load.name, &variant(period_ns), extent.turns, &progress)?);
        }
    }
    drop(progress);
    let mut machine = realtime::machine_facts();
    machine.push(("loads".to_owned(), described(&loads)));
    let turns = format!("{} turns of {} s each", extent.turns, extent.turn_ns as f64 / 1e9);
    machine.push(("measured".to_owned(), turns));
    let results = Results {
        command: "jitter",
        quick,
        machine,
        scheduling: all.first().map_or_else(String::new, |measured| measured.scheduling.clone()),
        sheets: vec![
            tables::wake_up(&all),
            apart::sheet(&apart),
            tables::execution(&all),
            tables::early(&all),
            tables::stalls(&all),
        ],
        data: json!({"loop": tables::data(&all), "address_spaces": apart::data(&apart)}),
    };
    page::page(&results, &all).write_html(&out.join("jitter.html"))?;
    Ok(results)
}

fn described(loads: &[load::Load]) -> String {
    let missing =
        LOADS.iter().filter(|load| !load.available()).map(|load| format!("{} (not installed)", load.name));
    loads.iter().map(load::Load::describe).chain(missing).collect::<Vec<_>>().join("; ")
}

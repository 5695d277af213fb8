//! `bench safety` and `bench safety-live`: faults by the thousand, at random moments, judged by the oracle.
//!
//! `safety` needs no clock: the loop in one thread and in lockstep, and files that are cut or wrong. `safety-live` is
//! real time: processes killed, stopped and starved on a running instance. Both print their seed; every trial's seed
//! and fault are in the JSON where something was found.

mod bus;
mod files;
mod ground;
mod in_process;
mod live;
mod live_record;
mod lockstep;
mod odd;
mod recorded_orders;
mod soak;
mod stopped;
mod tally;

use crate::output::Results;
use anyhow::Result;
use serde_json::json;
use tally::Tally;

/// How much is tried.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct Arguments {
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Trials; without, as many as docs/safety.md tells of
    #[arg(long)]
    trials: Option<u64>,
    /// Of `safety`: trials between processes in lockstep [default: a twentieth]
    #[arg(long)]
    lockstep: Option<u64>,
}

/// How long.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct SoakArguments {
    /// Minutes
    #[arg(long, default_value_t = 30.0)]
    minutes: f64,
}

/// Everything that needs no clock.
///
/// # Errors
/// Where a trial could not be made at all. What a trial found is in the results.
pub fn run(arguments: &Arguments, quick: bool) -> Result<Results> {
    let trials = arguments.trials.unwrap_or(if quick { 600 } else { 200_000 });
    let mut one_thread = Tally::default();
    in_process::campaign(arguments.seed, trials, &mut one_thread)?;
    let mut processes = Tally::default();
    let between = arguments.lockstep.unwrap_or(if quick { 20 } else { trials / 20 });
    lockstep::campaign(arguments.seed, between, &mut processes)?;
    let mut inputs = Tally::default();
    files::campaign(arguments.seed, trials, &mut inputs)?;
    Ok(Results {
        command: "safety",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "no clock".to_owned(),
        sheets: vec![
            one_thread.sheet("safety-in-process", "Faults in one thread, by kind; times in cycles"),
            processes.sheet("safety-lockstep", "The same between processes in lockstep; times in cycles"),
            inputs.short_sheet("safety-files", "Files that are wrong, cut or damaged"),
        ],
        data: json!({
            "seed": arguments.seed,
            "violations": one_thread.violations() + processes.violations() + inputs.violations(),
            "found": [one_thread.found(), processes.found(), inputs.found()],
        }),
    })
}

/// Everything that happens in real time.
///
/// # Errors
/// As [`run`].
pub fn run_live(arguments: &Arguments, quick: bool) -> Result<Results> {
    let trials = arguments.trials.unwrap_or(if quick { 24 } else { 1000 });
    let mut running = Tally::default();
    live::campaign(arguments.seed, trials * 7 / 10, &mut running)?;
    let mut around = Tally::default();
    odd::campaign(arguments.seed, trials * 3 / 10, &mut around)?;
    let mut orders = Tally::default();
    stopped::campaign(arguments.seed, trials, &mut orders)?;
    Ok(Results {
        command: "safety-live",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "as the scenario asks; what was refused is in each run's output".to_owned(),
        sheets: vec![
            running.sheet("safety-live", "Faults on a running instance, by kind; times in cycles of 1 ms"),
            around.short_sheet("safety-around", "Faults of start, end and surroundings"),
            stopped::sheet(&orders),
        ],
        data: json!({
            "seed": arguments.seed,
            "violations": running.violations() + around.violations() + orders.violations(),
            "found": [running.found(), around.found(), orders.found()],
        }),
    })
}

/// Faults of a drive's bus, in real time.
///
/// # Errors
/// As [`run`].
pub fn run_bus(arguments: &Arguments, quick: bool) -> Result<Results> {
    let trials = arguments.trials.unwrap_or(if quick { 10 } else { 300 });
    let mut tally = Tally::default();
    bus::campaign(arguments.seed, trials, &mut tally)?;
    Ok(Results {
        command: "safety-bus",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "as the scenario asks; what was refused is in each run's output".to_owned(),
        sheets: vec![tally.sheet("safety-bus", "Faults of a drive's bus, by kind; times in cycles of 1 ms, without those in which the machine stood still")],
        data: json!({"seed": arguments.seed, "violations": tally.violations(), "found": tally.found()}),
    })
}

/// A long run beside a load.
///
/// # Errors
/// As [`run`].
pub fn run_soak(arguments: &SoakArguments, quick: bool) -> Result<Results> {
    soak::run(if quick { 0.1 } else { arguments.minutes }, quick)
}

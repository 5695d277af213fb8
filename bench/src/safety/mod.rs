//! `bench safety`, `safety-live` and `safety-bus`: faults by the thousand, at random moments, judged by the oracle.
//!
//! `safety` needs no clock: the loop in one thread and in lockstep, and files that are cut or wrong. `safety-live` is
//! real time: processes killed, stopped and starved on a running instance. `safety-bus` hurts a drive's bus. All print
//! their seed; every trial's seed and fault are in the JSON where something was found.

mod bus;
mod day;
mod files;
mod ground;
mod homing;
mod in_process;
mod live;
mod live_record;
mod lockstep;
mod odd;
mod operated;
mod recorded_orders;
mod restarted;
mod soak;
mod stopped;
mod tally;

use crate::output::Results;
use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tally::Tally;

/// How much is tried.
#[derive(Debug, Clone, clap::Args)]
pub struct Arguments {
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Trials; without, as many as docs/safety.md tells of, 300 of `safety-bus`
    #[arg(long)]
    trials: Option<u64>,
    /// Of `safety`: trials between processes in lockstep [default: a twentieth]
    #[arg(long)]
    lockstep: Option<u64>,
    /// Try nothing: add up the results of earlier runs with other seeds
    #[arg(long, value_name = "FILE.json", num_args = 1.., conflicts_with_all = ["seed", "trials", "lockstep"])]
    merge: Vec<PathBuf>,
}

/// How long.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct SoakArguments {
    /// Minutes
    #[arg(long, default_value_t = 30.0)]
    minutes: f64,
}

/// What the campaigns of a command counted, and from which seeds.
#[derive(Debug, Serialize, Deserialize)]
struct Counts {
    seeds: Vec<u64>,
    tallies: Vec<Tally>,
}

impl Counts {
    /// Of the campaigns `tried`, or of earlier results where those are to be added up.
    fn of(arguments: &Arguments, tried: impl FnOnce(u64) -> Result<Vec<Tally>>) -> Result<Self> {
        let seed = arguments.seed;
        let Some((first, more)) = arguments.merge.split_first() else {
            return Ok(Self { seeds: vec![seed], tallies: tried(seed)? });
        };
        let mut sum = Self::read(first)?;
        for path in more {
            let other = Self::read(path)?;
            if let Some(seed) = other.seeds.iter().find(|seed| sum.seeds.contains(seed)) {
                bail!("{}: seed {seed} is among the files before, expected another", path.display());
            }
            if other.tallies.len() != sum.tallies.len() {
                bail!("{}: results of another command", path.display());
            }
            sum.seeds.extend(other.seeds);
            sum.tallies.iter_mut().zip(other.tallies).for_each(|(tally, other)| tally.add(other));
        }
        Ok(sum)
    }

    fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let mut results: Value = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
        let counts = results.pointer_mut("/data/counts").map(Value::take).unwrap_or_default();
        serde_json::from_value(counts).with_context(|| {
            format!("{}: no counts of `bench safety`, `safety-live` or `safety-bus`", path.display())
        })
    }

    fn json(&self) -> Value {
        json!({
            "counts": self,
            "violations": self.tallies.iter().map(Tally::violations).sum::<u64>(),
            "found": self.tallies.iter().map(Tally::found).collect::<Vec<_>>(),
        })
    }
}

/// Everything that needs no clock.
///
/// # Errors
/// Where a trial could not be made at all, or earlier results can't be read. What a trial found is in the results.
pub fn run(arguments: &Arguments, quick: bool) -> Result<Results> {
    let counts = Counts::of(arguments, |seed| {
        let trials = arguments.trials.unwrap_or(if quick { 600 } else { 200_000 });
        let mut one_thread = Tally::default();
        in_process::campaign(seed, trials, &mut one_thread)?;
        let mut processes = Tally::default();
        let between = arguments.lockstep.unwrap_or(if quick { 20 } else { trials / 20 });
        lockstep::campaign(seed, between, &mut processes)?;
        let mut orders = Tally::default();
        let each = trials.div_ceil(40);
        homing::campaign(seed, each, &mut orders)?;
        restarted::campaign(seed, each, &mut orders)?;
        let mut inputs = Tally::default();
        if trials > 0 {
            files::campaign(seed, trials, &mut inputs)?;
        }
        Ok(vec![one_thread, processes, orders, inputs])
    })?;
    let [one_thread, processes, orders, inputs] = counts.tallies.as_slice() else {
        bail!("four tables expected")
    };
    Ok(Results {
        command: "safety",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "no clock".to_owned(),
        sheets: vec![
            one_thread.sheet("safety-in-process", "Faults in one thread, by kind; times in cycles"),
            processes.sheet("safety-lockstep", "The same between processes in lockstep; times in cycles"),
            orders.short_sheet("safety-zero", "Homing interrupted, and starts anew, in one thread"),
            inputs.short_sheet("safety-files", "Files that are wrong, cut or damaged"),
        ],
        data: counts.json(),
    })
}

/// Everything that happens in real time.
///
/// # Errors
/// As [`run`].
pub fn run_live(arguments: &Arguments, quick: bool) -> Result<Results> {
    let counts = Counts::of(arguments, |seed| {
        let trials = arguments.trials.unwrap_or(if quick { 24 } else { 1000 });
        let mut running = Tally::default();
        live::campaign(seed, trials * 7 / 10, &mut running)?;
        let mut around = Tally::default();
        odd::campaign(seed, trials * 3 / 10, &mut around)?;
        let mut orders = Tally::default();
        stopped::campaign(seed, trials, &mut orders)?;
        Ok(vec![running, around, orders])
    })?;
    let [running, around, orders] = counts.tallies.as_slice() else { bail!("three tables expected") };
    Ok(Results {
        command: "safety-live",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "as the scenario asks; what was refused is in each run's output".to_owned(),
        sheets: vec![
            running.sheet("safety-live", "Faults on a running instance, by kind; times in cycles of 1 ms"),
            around.short_sheet("safety-around", "Faults of start, end and surroundings"),
            stopped::sheet(orders),
        ],
        data: counts.json(),
    })
}

/// Faults of a drive's bus, in real time.
///
/// # Errors
/// As [`run`].
pub fn run_bus(arguments: &Arguments, quick: bool) -> Result<Results> {
    let counts = Counts::of(arguments, |seed| {
        let trials = arguments.trials.unwrap_or(if quick { 10 } else { 300 });
        let mut tally = Tally::default();
        bus::campaign(seed, trials, &mut tally)?;
        Ok(vec![tally])
    })?;
    let [tally] = counts.tallies.as_slice() else { bail!("one table expected") };
    Ok(Results {
        command: "safety-bus",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "as the scenario asks; what was refused is in each run's output".to_owned(),
        sheets: vec![tally.sheet(
            "safety-bus",
            "Faults of a drive's bus, by kind; times in cycles of 1 ms, without those in which the machine stood still",
        )],
        data: counts.json(),
    })
}

/// A day without a clock.
///
/// # Errors
/// As [`run`].
pub fn run_day(quick: bool) -> Result<Results> {
    day::run(quick)
}

/// A long run beside a load.
///
/// # Errors
/// As [`run`].
pub fn run_soak(arguments: &SoakArguments, quick: bool) -> Result<Results> {
    soak::run(if quick { 0.1 } else { arguments.minutes }, quick)
}

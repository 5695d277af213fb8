//! `bench diagnosis`: `stepvalve diagnose` on campaigns with a hidden effect, beside regressions; what it costs.

mod ask;
mod baseline;
mod cases;
pub mod drives;
mod frols;
mod library;
mod normal;
mod own;
mod row;
mod run;
pub mod speed;
mod tables;
pub mod twins;
pub mod unnamed;

use crate::output::Results;
use crate::programs::beside;
use crate::progress::Progress;
use anyhow::{Context, Result};
use ask::Limits;
use row::{Row, Rows};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::num::NonZero;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// How much of it.
#[derive(clap::Args, Clone)]
pub struct Arguments {
    /// What the measurements are like
    #[arg(long, value_enum, default_value = "all")]
    family: Families,
    /// Seeds for each effect and strength; the others (two effects, twins, outside the list) in proportion
    #[arg(long, default_value_t = 6)]
    seeds: u64,
    /// Campaigns with nothing hidden, of each family
    #[arg(long, default_value_t = 300)]
    clean: u64,
    /// The first seed
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// About how many samples a campaign has
    #[arg(long, default_value_t = 60_000)]
    samples: usize,
    /// Begins no further campaign after so many minutes; which ones are then left out is a matter of chance
    #[arg(long, value_name = "MINUTES")]
    minutes: Option<u64>,
    /// Ends a diagnosis after so many seconds; it counts as one that found nothing
    #[arg(long, value_name = "SECONDS", default_value_t = 900, value_parser = clap::value_parser!(u64).range(1..))]
    limit: u64,
    /// Campaigns at a time [default: as many as there are processors]
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    threads: Option<u64>,
    /// Go on with OUT/diagnosis.jsonl: what is in it is not asked again, and counts
    #[arg(long)]
    resume: bool,
    /// Logs of one kind alone
    #[arg(long, value_enum)]
    log: Option<Log>,
    /// Campaigns alone that hide this effect, by itself or beside another; may be given more than once
    #[arg(long, value_name = "EFFECT")]
    only: Vec<String>,
    /// Campaigns of one class alone: nothing hidden, one effect strong or weak, two, outside the list, twins
    #[arg(long, value_enum)]
    class: Vec<cases::Class>,
    /// Single effects of another form than the product's: their parameters against the best fit to noise-free data (exact
    /// family)
    #[arg(long)]
    best_fit: bool,
}

/// Which families are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Families {
    /// Exact numbers, a fine encoder, white noise.
    Exact,
    /// Instruments, models, motions and records of the field.
    Real,
    /// What `stepvalve simulate` records, diagnosed with the belief.
    Own,
    /// Each of them, kept apart.
    All,
}

/// What measurements are like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Family {
    /// Exact numbers, a fine encoder, white noise.
    Exact,
    /// Instruments, models, motions and records of the field.
    Real,
    /// What `stepvalve simulate` records, diagnosed with the belief.
    Own,
}

impl Families {
    fn members(self) -> &'static [Family] {
        match self {
            Self::Exact => &[Family::Exact],
            Self::Real => &[Family::Real],
            Self::Own => &[Family::Own],
            Self::All => &[Family::Exact, Family::Real, Family::Own],
        }
    }
}

/// Which logs are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Log {
    /// Torque and angle.
    Torque,
    /// Command and angle.
    Angle,
}

/// Runs all campaigns; each is written to `OUT/diagnosis.jsonl` once it is judged.
///
/// # Errors
/// Where the program is missing or a diagnosis fails.
pub fn run(arguments: &Arguments, quick: bool, out: &Path) -> Result<Results> {
    let arguments = if quick {
        Arguments { seeds: 1, clean: 6, samples: 20_000, ..arguments.clone() }
    } else {
        arguments.clone()
    };
    let mut cases = cases::all(&arguments);
    let processors = std::thread::available_parallelism().map_or(1, NonZero::get);
    let limits = Limits {
        all: arguments.minutes.map(|minutes| Duration::from_secs(60 * minutes)),
        each: Duration::from_secs(arguments.limit),
        threads: arguments.threads.map_or(processors, |threads| threads as usize),
        program: crc32c::crc32c(&std::fs::read(beside("stepvalve")?).context("stepvalve")?),
    };
    let (rows, mut judged) =
        Rows::open(out.join("diagnosis.jsonl"), arguments.resume, &cases, limits.program)?;
    cases.retain(|case| judged.iter().all(|row| row.key != case.key()));
    eprintln!(
        "seeds from {} on; {} campaigns to ask, {} asked before",
        arguments.first_seed,
        cases.len(),
        judged.len()
    );
    let progress = Mutex::new(Progress::new(cases.len()));
    let rows = Mutex::new(rows);
    let record = |row: &Row| rows.lock().unwrap_or_else(PoisonError::into_inner).add(row);
    judged.extend(run::all(&cases, &progress, limits, &record)?);
    Ok(Results {
        command: "diagnosis",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "the normal scheduler".to_owned(),
        sheets: tables::all(&judged),
        data: json!(judged),
    })
}

//! `bench diagnosis`: `stepvalve diagnose` on campaigns with a hidden effect, beside a stepwise regression; what it costs.

mod baseline;
mod cases;
mod library;
mod run;
pub mod speed;
mod tables;

use crate::output::Results;
use crate::progress::Progress;
use anyhow::{Context, Result};
use run::{Judged, Limits};
use serde_json::json;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// How much of it.
#[derive(clap::Args, Clone)]
pub struct Arguments {
    /// Seeds for each effect and strength; the others (nothing hidden, two effects, twins) in proportion
    #[arg(long, default_value_t = 6)]
    seeds: u64,
    /// Campaigns with nothing hidden
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
    /// Logs of one kind alone
    #[arg(long, value_enum)]
    log: Option<Log>,
    /// Campaigns alone that hide this effect, by itself or beside another; may be given more than once
    #[arg(long, value_name = "EFFECT")]
    only: Vec<String>,
    /// Campaigns of one class alone: nothing hidden, one effect strong or weak, two, outside the list, twins
    #[arg(long, value_enum)]
    class: Vec<cases::Class>,
    /// Single effects of another form than the product's: their parameters against the best fit to noise-free data
    #[arg(long)]
    best_fit: bool,
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
    let cases = cases::all(&arguments);
    let progress = Mutex::new(Progress::new(cases.len()));
    let limits = Limits {
        all: arguments.minutes.map(|minutes| Duration::from_secs(60 * minutes)),
        each: Duration::from_secs(arguments.limit),
    };
    let path = out.join("diagnosis.jsonl");
    let lines = Mutex::new(File::create(&path).with_context(|| path.display().to_string())?);
    let record = |judged: &Judged| {
        let mut lines = lines.lock().unwrap_or_else(PoisonError::into_inner);
        writeln!(lines, "{}", judged.json()).with_context(|| path.display().to_string())
    };
    let judged = run::all(&cases, &progress, limits, &record)?;
    let sheets = tables::all(&judged);
    let data = judged.iter().map(Judged::json).collect::<Vec<_>>();
    Ok(Results {
        command: "diagnosis",
        quick,
        machine: realtime::machine_facts(),
        scheduling: "the normal scheduler".to_owned(),
        sheets,
        data: json!(data),
    })
}

//! `stepvalve run`: the valve without an end, in real time, spoken to over its control socket.

use crate::errand::{Errand, hand_over};
use crate::keep::{holds, parse_keep};
use crate::loaded;
use crate::output::Output;
use crate::record_info::{Mode, record_info};
use crate::say::say;
use crate::summary::{ProcessSummary, by_process};
use anyhow::anyhow;
use processes::{Keep, Pace, complain};
use recording::RecordInfo;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use supervisor::{Ending, Failure, InstanceName, Mission, Outcome};

/// What to run.
#[derive(clap::Args)]
pub struct Arguments {
    /// The scenario: its models, limits, driver and timing; its set-points and its end are left out
    #[arg(value_name = "SCENARIO.toml")]
    scenario: PathBuf,
    /// Name of the instance: what `stepvalve status --instance NAME` and the others ask for
    #[arg(long, value_name = "NAME")]
    instance: InstanceName,
    /// Folder for the record and the timing of slow cycles: a new one, or that of an earlier start of this instance
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// What to record: `none`, `all`, or `ring=SIZE`, the newest segments of that size together (500MB, 2GB) and those
    /// around a fault
    #[arg(long, value_name = "none|all|ring=SIZE", default_value = "ring=2GB", value_parser = parse_keep)]
    record: Keep,
    /// Fail instead of running without the scheduling, core or locked memory that the scenario asks for
    #[arg(long)]
    require_realtime: bool,
    /// Let `stepvalve inject` make things go wrong on purpose; never beside a real valve
    #[arg(long)]
    allow_injection: bool,
    /// Print how it ended as JSON
    #[arg(long)]
    json: bool,
}

/// Runs until SIGTERM (exit code 0), SIGINT or SIGHUP (130), or until the processes died too often (1): becomes the
/// supervisor, so it returns only where that fails.
///
/// # Errors
/// [`Failure::Input`] before anything is started; [`Failure::Failed`] where the supervisor can't be started.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let loaded = loaded::load(&arguments.scenario)?;
    for warning in loaded.scenario.warnings() {
        complain(format_args!("note: {warning}"));
    }
    let (output, earlier) = Output::of_instance(&arguments.out, &arguments.instance)?;
    if let Some(earlier) = &earlier {
        complain(format_args!("note: {}", earlier.note(output.folder(), &loaded.texts)));
    }
    if let Keep::Ring { bytes } = arguments.record {
        let length = holds(bytes, loaded.scenario.period_ns, loaded.bridge.is_some());
        complain(format_args!(
            "note: the ring of {} MB holds at least the last {length}, and faults",
            bytes / 1_000_000
        ));
    }
    let mission = Mission {
        name: arguments.instance.clone(),
        pace: Pace::Realtime,
        stays: true,
        absolute_encoder: loaded.scenario.encoder.absolute,
        timings: loaded.timings(),
        bridge: loaded.bridge.clone(),
        folder: output.folder().to_owned(),
        keep: arguments.record,
        info: RecordInfo {
            operated: true,
            // Messages of two starts must never have the same number.
            generation: earlier.map_or(0, |earlier| earlier.generation()) + 1,
            ..record_info(&loaded, Mode::Realtime, &arguments.instance.to_string())
        },
        parts: loaded.parts.without_end(),
        injections: arguments.allow_injection.then(Vec::new),
        require_realtime: arguments.require_realtime,
        errand: Vec::new(),
    };
    hand_over(mission, &Errand::Run { out: arguments.out.clone(), json: arguments.json })
}

/// How an instance ended, for machines.
#[derive(Serialize)]
struct Stay<'a> {
    /// Starts of the processes.
    generations: u64,
    /// What went wrong for good.
    failure: Option<&'a str>,
    /// What is not in the record and should be.
    lost_record: Option<String>,
    /// Messages that the supervisor itself published in the last generation.
    published: u64,
    /// What each process had to say in the last generation.
    processes: BTreeMap<String, ProcessSummary>,
}

/// Tells how it ended.
///
/// # Errors
/// [`Failure::Failed`] where the processes died too often, or the disk did not take the record.
pub fn conclude(out: &Path, json: bool, ending: Ending) -> Result<Outcome, Failure> {
    report(out, json, &ending)?;
    let lost_record = ending.lost_record().map(|lost| format!("the record is not whole: {lost}"));
    match ending.failure.or(lost_record) {
        Some(failure) => Err(Failure::Failed(anyhow!("{failure}"))),
        None if ending.terminated => Ok(Outcome::Done),
        None => Ok(Outcome::Interrupted),
    }
}

fn report(out: &Path, json: bool, ending: &Ending) -> Result<(), Failure> {
    if json {
        let stay = Stay {
            generations: ending.generations,
            failure: ending.failure.as_deref(),
            lost_record: ending.lost_record(),
            published: ending.published,
            processes: by_process(&ending.processes),
        };
        say(serde_json::to_string_pretty(&stay).map_err(anyhow::Error::from)?);
        return Ok(());
    }
    match ending.generations {
        0 | 1 => say("stopped"),
        starts => say(format_args!("stopped; the processes were started {starts} times")),
    }
    let output = Output::of_run(out);
    let segments = output.segments();
    if !segments.is_empty() {
        let folder = output.folder().display();
        say(format_args!(
            "record: {} segment{}; stepvalve convert {folder} --out {folder}/run.h5",
            segments.len(),
            if segments.len() == 1 { "" } else { "s" }
        ));
    }
    Ok(())
}

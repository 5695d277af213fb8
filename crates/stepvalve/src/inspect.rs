//! `stepvalve inspect`: what is wrong with a log itself, before anything is computed from it.

use crate::diagnose::logs;
use crate::files::{self, name, names};
use crate::findings::show;
use crate::pulse::Pulse;
use crate::say::say;
use crate::strangers;
use anyhow::Context;
use log_data::{Channel, Log};
use log_quality::{Severity, inspect, untold};
use serde_json::json;
use std::path::PathBuf;
use supervisor::{Failure, Outcome};

/// What to inspect.
#[derive(clap::Args)]
pub struct Arguments {
    /// Measured runs (valve-log). Several logs are inspected as one, as `diagnose --log` reads them
    #[arg(value_name = "LOG.h5", required = true)]
    logs: Vec<PathBuf>,
    /// The model that the runs are to be held against: units, signs and exchanged channels show against it
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// For machines: all findings as JSON
    #[arg(long)]
    json: bool,
}

/// Says what is in the log, and what is wrong with it.
///
/// # Errors
/// [`Failure::Input`] where the log or the model can't be used; [`Failure::Failed`] where the log has a mistake that results
/// would suffer from.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let model = match &arguments.model {
        Some(file) => Some(config::parse_model(&files::read(file)?, &name(file)).map_err(Failure::input)?),
        None => None,
    };
    let pulse = Pulse::new(|| "inspecting".to_owned());
    let log = match arguments.logs.as_slice() {
        [one] => strangers::log(one)?,
        several => logs::read(several, &[])?,
    };
    let files = names(&arguments.logs);
    let found = inspect(&log, model.as_ref());
    let untold = model.as_ref().map(|model| untold(&log, model)).unwrap_or_default();
    let untold: Vec<&str> = untold.iter().map(|channel| channel.name()).collect();
    drop(pulse);
    if arguments.json {
        let all = json!({
            "format": "stepvalve-inspection", "format_version": 1, "log": files,
            "runs": log.runs.len(), "findings": found, "unit_untold": untold,
        });
        say(serde_json::to_string_pretty(&all).context("findings")?);
    } else {
        say(contents(&log));
        show(&found);
        if found.is_empty() {
            say("nothing is wrong with it");
        }
        if !untold.is_empty() {
            say(format_args!(
                "the unit of {} can't be told from it: the model agrees as well with another in its place, degrees or turns of an angle, milliseconds \
                 of a time",
                untold.join(" and that of ")
            ));
        }
        if model.is_none() {
            say("units and signs show against a model only: --model MODEL.toml");
        }
    }
    let mistakes = found.iter().filter(|finding| finding.severity == Severity::Mistake).count();
    match mistakes {
        0 => Ok(Outcome::Done),
        1 => Err(Failure::Failed(anyhow::anyhow!("{files}: 1 mistake"))),
        more => Err(Failure::Failed(anyhow::anyhow!("{files}: {more} mistakes"))),
    }
}

/// A log in a line.
fn contents(log: &Log) -> String {
    let has = |channel: &&Channel| log.runs.iter().any(|run| run.channel(**channel).is_some());
    let channels: Vec<&str> = Channel::ALL.iter().filter(has).map(|channel| channel.name()).collect();
    let samples: usize = log.runs.iter().map(log_data::Run::len).sum();
    let runs = if log.runs.len() == 1 { "1 run".to_owned() } else { format!("{} runs", log.runs.len()) };
    format!("{}: {runs}, {samples} samples, {}", log.title, channels.join(", "))
}

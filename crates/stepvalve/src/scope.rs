//! `stepvalve scope`: a running instance in a browser, on this machine alone.

use crate::operator::{Which, meant};
use crate::say::say;
use anyhow::{Context, anyhow};
use config::parse_scenario;
use scope::{Opened, Options, serve};
use std::path::{Path, PathBuf};
use std::time::Duration;
use supervisor::{Failure, FoundInstance, Interruption, Outcome, base_folder, whereabouts};

/// The longest past that is held: each second of a 1 kHz loop takes about 2 MB.
const MOST_HISTORY: Duration = Duration::from_secs(600);

/// What to look at.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Saved captures, or short records, to open; no instance need run then
    #[arg(value_name = "CAPTURE.mcap")]
    files: Vec<PathBuf>,
    /// Port on 127.0.0.1 [default: any that is free]
    #[arg(long, value_name = "PORT", default_value_t = 0, hide_default_value = true)]
    port: u16,
    /// How much of the past is held: what can lie before a trigger, and what a signal shows at once
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = humantime::parse_duration)]
    history: Duration,
    /// Where captures are saved [default: captures, in the folder of the instance's record]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// How many captures may save themselves
    #[arg(long, value_name = "N", default_value_t = 100)]
    captures: usize,
    /// A page of this origin may connect too, with the token; for Foxglove in a browser `https://app.foxglove.dev`
    #[arg(long, value_name = "ORIGIN")]
    allow_origin: Vec<String>,
    #[command(flatten)]
    which: Which,
}

/// Serves until Ctrl-C.
///
/// # Errors
/// [`Failure::Input`] where there is no such instance or file; [`Failure::Failed`] where the port is taken.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check(arguments)?;
    let instance = match find(&arguments.which) {
        Ok(folder) => Some(folder),
        // Captures can be looked at on any machine.
        Err(_) if !arguments.files.is_empty() && arguments.which.instance.is_none() => None,
        Err(error) => return Err(error),
    };
    let options = Options {
        folder: folder(arguments, instance.as_deref())?,
        loop_cores: instance.as_deref().map(loop_cores).unwrap_or_default(),
        instance,
        files: arguments.files.clone(),
        port: arguments.port,
        history: arguments.history,
        captures: arguments.captures,
        origins: arguments.allow_origin.clone(),
        program: std::env::current_exe().context("this program's own file")?,
    };
    let interruption = Interruption::watch()?;
    serve(&options, &interruption, |opened| tell(opened, &options, arguments.which.json))
        .map_err(|error| Failure::Failed(error.into()))?;
    Ok(Outcome::Interrupted)
}

/// The folder of the instance that is meant: one of `run`, or a simulation, which takes no orders and can be looked at.
fn find(which: &Which) -> Result<PathBuf, Failure> {
    let shows = |found: &FoundInstance| found.alive && whereabouts(&found.folder).is_ok();
    Ok(meant(&base_folder()?, which, shows)?.folder)
}

fn check(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.history.is_zero() || arguments.history > MOST_HISTORY {
        return Err(Failure::Input(anyhow!(
            "--history {}: expected more than nothing and at most {}",
            humantime::format_duration(arguments.history),
            humantime::format_duration(MOST_HISTORY)
        )));
    }
    for file in &arguments.files {
        recording::read_info(file).map_err(Failure::input)?;
    }
    Ok(())
}

/// The cores that the instance's scenario gives to the processes with deadlines.
fn loop_cores(instance: &Path) -> Vec<usize> {
    let text = whereabouts(instance).map(|at| at.info.texts.scenario).unwrap_or_default();
    let timing = parse_scenario(&text, "scenario").map(|scenario| scenario.timing);
    let cores = timing.map(|timing| [timing.plant.core, timing.trajectory.core, timing.controller.core]);
    cores.into_iter().flatten().flatten().collect()
}

fn folder(arguments: &Arguments, instance: Option<&Path>) -> Result<PathBuf, Failure> {
    let folder = match (&arguments.out, instance) {
        (Some(out), _) => out.clone(),
        (None, Some(instance)) => {
            let at = whereabouts(instance).context("the instance is starting or ending")?;
            at.record.join("captures")
        }
        (None, None) => PathBuf::from("captures"),
    };
    Ok(std::path::absolute(folder).context("--out")?)
}

fn tell(opened: &Opened, options: &Options, json: bool) {
    let Opened { page, foxglove } = opened;
    let captures = options.folder.display();
    if json {
        say(serde_json::json!({ "page": page, "foxglove": foxglove, "captures": captures.to_string() }));
        return;
    }
    say(format_args!("open in a browser of this machine, by this user alone:\n\n    {page}\n"));
    say(format_args!("Foxglove, Lichtblick, PlotJuggler: {foxglove}"));
    say(format_args!("captures go to {captures}; Ctrl-C ends the view, not the valve"));
}

//! `stepvalve investigate`: diagnose, plan, measure, diagnose again, until it is decided.

mod live;
mod machine;
mod measured;
mod simulated;
mod story;

use crate::diagnose::{self, Step, limit};
use crate::files::name;
use crate::operator::Which;
use crate::say::say;
use anyhow::anyhow;
use clap::ArgGroup;
use diagnosis::Verdict;
use live::Live;
use machine::{Machine, Made};
use measured::Measured;
use processes::complain;
use simulated::Simulated;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use story::{End, Story, Told};
use study::Answer;
use study::experiment::{Range, TOML_FILE, range};
use supervisor::{Failure, InstanceName, Outcome};

/// What to hold against what, and where experiments are made.
#[derive(clap::Args)]
#[command(group = ArgGroup::new("machine").required(true).args(["scenario", "log", "live"]))]
pub struct Arguments {
    /// A scenario whose truth is the valve, simulated: only its record is looked at
    #[arg(value_name = "SCENARIO.toml")]
    scenario: Option<PathBuf>,
    /// What was measured on a rig; --measure makes the experiments on it
    #[arg(long, value_name = "LOG.h5", requires = "measure", num_args = 1..)]
    log: Vec<PathBuf>,
    /// What makes an experiment on the rig, a shell's command. It finds the plan in $STEPVALVE_PLAN (TOML) and $STEPVALVE_CSV, the
    /// experiment's number in $STEPVALVE_EXPERIMENT, and writes a valve-log to $STEPVALVE_LOG
    #[arg(long, value_name = "COMMAND", requires = "log")]
    measure: Option<String>,
    /// Experiments are made on the running instance, armed, each motion after you have agreed to it
    #[arg(long)]
    live: bool,
    /// The model
    #[arg(long, value_name = "MODEL.toml")]
    against: PathBuf,
    /// The folder for investigation.html, investigation.json, model-extended.toml, and a folder for each experiment
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The most experiments beyond the first record
    #[arg(long, value_name = "N", default_value_t = 3)]
    experiments: usize,
    /// The longest that an experiment may take
    #[arg(long, value_name = "TIME", value_parser = limit, default_value = "60s")]
    experiment_time: Duration,
    /// What experiments may do: angle, speed, acceleration, pressure_drop or oil_temperature with a range, such as
    /// pressure_drop=0MPa..16MPa; without, as far as the log or the scenario's limits go. Any number of them
    #[arg(long, value_name = "RANGE", value_parser = range)]
    within: Vec<Range>,
    /// How well the model's numbers are known, as a standard deviation in parts of each
    #[arg(long, value_name = "PART", default_value_t = 0.03, value_parser = diagnose::tolerance)]
    tolerance: f64,
    /// Begins nothing new after this time, and tells what is known then
    #[arg(long, value_name = "TIME", value_parser = limit, default_value = "10min")]
    limit: Duration,
    /// With --live: the instance [default: the one that runs, if it is the only one]
    #[arg(long, value_name = "NAME", requires = "live")]
    instance: Option<InstanceName>,
}

/// Investigates, and writes the story when it ends.
///
/// # Errors
/// [`Failure::Input`] where a file can't be used or the folder holds an investigation; [`Failure::Failed`] where an experiment
/// can't be made or writing fails.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let out = &arguments.out;
    if out.join(story::PAGE).exists() || out.join("1").exists() {
        return Err(Failure::Input(anyhow!(
            "{} holds an investigation: give --out another folder",
            name(out)
        )));
    }
    let mut machine = machine_of(arguments)?;
    let begun = Instant::now();
    let mut story = Story::default();
    let mut logs: Vec<PathBuf> = Vec::new();
    let mut plan: Option<PathBuf> = None;
    let mut interrupted = false;
    let end = loop {
        let number = story.steps.len() + 1;
        let folder = out.join(number.to_string());
        std::fs::create_dir_all(&folder).map_err(|error| anyhow!("{}: {error}", name(&folder)))?;
        match machine.make(number, plan.as_deref(), &folder)? {
            Made::Logs(made) => logs.extend(made),
            Made::Declined => break End::Declined,
            Made::Interrupted => {
                interrupted = true;
                break End::Declined;
            }
        }
        let finished = diagnosed(arguments, &*machine, &logs, &folder, begun)?;
        say(format_args!("{number}: {}", finished.headline()));
        let end = ended(arguments, &finished, number, begun);
        plan = finished.next.as_ref().filter(|next| next.decides).map(|_| folder.join(TOML_FILE));
        story.steps.push(Told::new(&finished, plan.as_deref(), number));
        if let Some(end) = end {
            break end;
        }
        if let Some(next) = &finished.next {
            say(format_args!("   {}", next.said));
        }
    };
    if story.steps.is_empty() {
        return Ok(if interrupted { Outcome::Interrupted } else { Outcome::Done });
    }
    story.write(out, &arguments.against, end)?;
    say(format_args!("{}: {}", end.name(), end.sentence()));
    say(format_args!("{}, with model-extended.toml and investigation.json", name(&out.join(story::PAGE))));
    Ok(if interrupted { Outcome::Interrupted } else { Outcome::Done })
}

fn machine_of(arguments: &Arguments) -> Result<Box<dyn Machine>, Failure> {
    if let Some(scenario) = &arguments.scenario {
        return Ok(Box::new(Simulated::new(scenario)?));
    }
    let which = Which { instance: arguments.instance.clone(), json: false };
    match &arguments.measure {
        Some(command) => Ok(Box::new(Measured::new(&arguments.log, command))),
        None => Ok(Box::new(Live::find(&which, &arguments.out, &arguments.within)?)),
    }
}

/// The diagnosis of everything that was measured so far.
fn diagnosed(
    arguments: &Arguments,
    machine: &dyn Machine,
    logs: &[PathBuf],
    folder: &Path,
    begun: Instant,
) -> Result<Answer, Failure> {
    complain(format_args!("diagnosing {} records", logs.len()));
    let left = arguments.limit.saturating_sub(begun.elapsed());
    diagnose::diagnosed(&diagnose::Arguments::of_a_step(Step {
        logs: logs.to_vec(),
        model: arguments.against.clone(),
        out: folder.to_owned(),
        tolerance: arguments.tolerance,
        scenario: machine.scenario().map(Path::to_owned),
        within: arguments.within.clone(),
        experiment_time: arguments.experiment_time,
        most: left.max(Duration::from_secs(1)),
        orders_alone: arguments.live,
        clock: machine.clock(),
    }))
}

/// Whether that was the last experiment, and why.
fn ended(arguments: &Arguments, finished: &Answer, number: usize, begun: Instant) -> Option<End> {
    match finished.found.diagnosis.verdict {
        Verdict::Explained => return Some(End::Decided),
        Verdict::NoDiscrepancy => return Some(End::Agrees),
        Verdict::PartlyExplained | Verdict::Ambiguous | Verdict::Unexplained => {}
    }
    match &finished.next {
        None => Some(End::Unexplained),
        Some(next) if !next.decides => Some(End::NothingMore),
        Some(_) if number > arguments.experiments => Some(End::Enough),
        Some(_) if begun.elapsed() > arguments.limit => Some(End::Limit),
        Some(_) => None,
    }
}

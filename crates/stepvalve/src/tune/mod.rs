//! `stepvalve tune`: the belief's numbers from a short motion, or from a record.

mod motion;
mod record;
mod told;

use crate::diagnose::{fix, logs};
use crate::files::{self, name};
use crate::live_motion::{Agreed, LiveValve};
use crate::operator::Which;
use crate::pulse::Pulse;
use anyhow::{Context, anyhow};
use clap::ArgGroup;
use diagnosis::{Event, Options, identify};
use log_data::Log;
use processes::complain;
use std::path::{Path, PathBuf};
use std::time::Duration;
use study::experiment::first_motions;
use study::{Fixed, Reading, Threads, readings};
use supervisor::{Failure, InstanceName, Outcome};
use valve_model::{EffectId, Model};

/// What to tune, on what, and where to write it.
#[derive(clap::Args)]
#[command(group = ArgGroup::new("source").required(true).args(["scenario", "record", "live"]))]
pub struct Arguments {
    /// The scenario: its truth stands for the valve, its belief is where the search begins
    #[arg(value_name = "SCENARIO.toml")]
    scenario: Option<PathBuf>,
    /// A record of the valve in place of a simulated motion: a run's folder, its run.h5 or .mcap segments, or any valve-log with
    /// angle and angle_command. It should move slowly and fast, far and little
    #[arg(long, value_name = "RECORD", num_args = 1..)]
    record: Vec<PathBuf>,
    /// The running instance, armed: motions of it, each after you have agreed to it
    #[arg(long)]
    live: bool,
    /// Where the search begins, for a record; else the belief that the record carries
    #[arg(long, value_name = "MODEL.toml", conflicts_with = "scenario")]
    belief: Option<PathBuf>,
    /// The model file to write; it must not exist
    #[arg(long, value_name = "BELIEF.toml")]
    out: PathBuf,
    /// A number of the belief that is known exactly, SECTION.KEY=VALUE as in the model file. A motion shows torques in parts of
    /// the motor's holding torque alone: with load.inertia_kg_m2 known it shows the holding torque too
    #[arg(long, value_name = "PARAMETER=VALUE")]
    fix: Vec<String>,
    /// Decides which parts of the motion judge the result: the same seed, the same answer
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// With --live: the instance [default: the one that runs, if it is the only one]
    #[arg(long, value_name = "NAME", requires = "live")]
    instance: Option<InstanceName>,
}

/// What is searched for longer than this ends with what it has.
const LIMIT: Duration = Duration::from_secs(120);

/// A record, and the belief that it is held against.
struct Source {
    log: Log,
    belief: Model,
    fixed: Vec<EffectId>,
    /// In words.
    of: String,
}

/// Moves the valve or reads its record, fits, prints and writes.
///
/// # Errors
/// [`Failure::Input`] for a scenario without an encoder, a record that shows nothing, or an output that exists;
/// [`Failure::Failed`] where the file can't be written.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let out = &arguments.out;
    if out.exists() {
        return Err(Failure::Input(anyhow!("{} exists: give --out another name", name(out))));
    }
    files::room_for(out, true)?;
    let Source { log, belief, fixed, of } = match &arguments.scenario {
        Some(scenario) => simulated(scenario, &arguments.fix)?,
        None if arguments.live => match live(arguments.instance.clone(), &arguments.fix)? {
            Some(source) => source,
            None => return Ok(Outcome::Interrupted),
        },
        None => record::source(&arguments.record, arguments.belief.as_deref(), &arguments.fix)?,
    };
    if belief.motor.is_none() || log.runs.iter().any(|run| run.angle_command_rad.is_none()) {
        return Err(Failure::Input(anyhow!(
            "{of}: expected angle and angle_command in every run, and a belief with a [motor]; what a torque transducer measured is held \
             against a model by `stepvalve diagnose --tolerance 0.25`"
        )));
    }
    // Missing samples are bridged; where too many are missing, a run is cut.
    let readings = readings(log, &belief).with_context(|| of.clone()).map_err(Failure::Input)?;
    let Some(Reading { log, told, .. }) = readings.into_iter().next() else {
        return Err(Failure::Input(anyhow!("{of}: no run is left")));
    };
    told.iter().for_each(complain);
    let options = Options { seed: arguments.seed, fixed, ..Options::default() };
    let pulse = Pulse::new(|| "fitting the belief".to_owned());
    let mut tell = |event: Event<'_>| {
        if let Event::Step(step) | Event::Again(step) = event {
            complain(step);
        }
    };
    let found = identify(&log, &belief, &options, &Threads::new(Some(LIMIT)), &mut tell);
    let found = found.context(of.clone()).map_err(Failure::Input)?;
    drop(pulse);
    told::report(&found, &belief, &of);
    whole_file::write(out, told::file(&found, &belief, &of)).with_context(|| name(out))?;
    Ok(Outcome::Done)
}

/// The identification motion of a scenario's simulated valve.
fn simulated(path: &Path, fixes: &[String]) -> Result<Source, Failure> {
    let file = name(path);
    let scenario = config::parse_scenario(&files::read(path)?, &file).map_err(Failure::input)?;
    let truth = files::beside(path, &scenario.truth);
    let truth = config::parse_model(&files::read(&truth)?, &name(&truth)).map_err(Failure::input)?;
    let Fixed { model: belief, effects: fixed } = fix::read(&files::beside(path, &scenario.belief), fixes)?;
    if !scenario.encoder.fitted {
        return Err(Failure::Input(anyhow!(
            "{file}: no encoder is fitted, and the command alone says nothing of friction"
        )));
    }
    let motion = motion::identification(&scenario);
    let log = motion::made(&motion, &truth, &belief).context("the identification motion");
    let of = format!("an identification motion of {:.0} s, simulated", motion.duration_s);
    Ok(Source { log: log.map_err(Failure::Input)?, belief, fixed, of })
}

/// Motions of a running instance; `None` where its operator agreed to none, or ended them.
fn live(instance: Option<InstanceName>, fixes: &[String]) -> Result<Option<Source>, Failure> {
    let valve = LiveValve::find(&Which { instance, json: false })?;
    let folder = tempfile::tempdir().context("a folder for the record").map_err(Failure::Failed)?;
    let record = folder.path().join("live.h5");
    let motions = first_motions(valve.scenario(), valve.belief(), &[]);
    if !matches!(valve.make(&motions, &record)?, Agreed::Made) {
        return Ok(None);
    }
    valve.write_files(folder.path())?;
    let Fixed { model: belief, effects: fixed } = fix::read(&folder.path().join("belief.toml"), fixes)?;
    Ok(Some(Source {
        log: logs::read(&[record], &[])?,
        belief,
        fixed,
        of: "motions of the running instance".to_owned(),
    }))
}

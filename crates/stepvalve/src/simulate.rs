//! `stepvalve simulate`: a scenario in closed loop, in one of three modes, to its end.

use crate::errand::{Errand, Simulation, hand_over};
use crate::files;
use crate::in_process;
use crate::keep::parse_keep;
use crate::loaded::{self, Loaded};
use crate::metrics::note;
use crate::output::Output;
use crate::record_info::{Mode, record_info};
use crate::report;
use crate::say::say;
use crate::summary::{Summary, by_process};
use anyhow::anyhow;
use closed_loop::Metrics;
use injection::Injection;
use processes::{Keep, Pace, complain};
use realtime::now_ns;
use recording::read_record;
use std::path::PathBuf;
use supervisor::{Ending, Failure, InstanceName, Interruption, Mission, Outcome};

/// What to run, how, and where to.
#[derive(clap::Args)]
pub struct Arguments {
    /// The scenario
    #[arg(value_name = "SCENARIO.toml")]
    scenario: PathBuf,
    /// How to run it
    #[arg(long, value_enum, default_value_t = Mode::Realtime)]
    mode: Mode,
    /// Folder for run.h5, run.html and the record (run-0001.mcap); it must not hold a run yet
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Name of the instance; two of one name can't run at once [default: one of this process's own]
    #[arg(long, value_name = "NAME")]
    instance: Option<InstanceName>,
    /// What to record: `all`, or `none` (no run.h5 either) to see how fast it goes
    #[arg(long, value_name = "none|all", default_value = "all", value_parser = parse_keep)]
    record: Keep,
    /// Fail instead of running without the scheduling, core or locked memory that the scenario asks for
    #[arg(long)]
    require_realtime: bool,
    /// Let the faults given with --inject happen
    #[arg(long)]
    allow_injection: bool,
    /// A fault, as `stepvalve inject` takes it, in one argument, with the cycle: "flip-bits feedback bits=3 seed=7 at=1200".
    /// Any number of them
    #[arg(long, value_name = "FAULT", requires = "allow_injection")]
    inject: Vec<String>,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the scenario and prints the summary; between processes it becomes the supervisor, and returns only where that fails.
///
/// # Errors
/// [`Failure::Input`] before anything is started; [`Failure::Failed`] where the run or its record failed.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if matches!(arguments.record, Keep::Ring { .. }) {
        return Err(Failure::Input(anyhow!("--record takes none or all here: a scenario has an end")));
    }
    let injections = injections(arguments)?;
    let loaded = loaded::load(&arguments.scenario)?;
    if loaded.bridge.is_some() {
        // It arms by itself, which a real valve must not.
        return Err(Failure::Input(anyhow!(
            "{}: [drive] is a real one, expected none: `simulate` arms by itself; `stepvalve run` runs it",
            files::name(&arguments.scenario)
        )));
    }
    for warning in loaded.scenario.warnings() {
        complain(format_args!("note: {warning}"));
    }
    let output = match arguments.mode {
        Mode::InProcess => Output::prepare(&arguments.out)?,
        Mode::Realtime | Mode::Lockstep => Output::without_run(&arguments.out)?,
    };
    let simulation = Simulation {
        title: loaded.scenario.name.clone(),
        mode: arguments.mode,
        cycles: loaded.parts.timeline.last_cycle + 1,
        period_s: loaded.scenario.period_s(),
        begun_ns: now_ns(),
        out: arguments.out.clone(),
        keep: arguments.record,
        json: arguments.json,
        injected: !injections.is_empty(),
        encoder: loaded.scenario.encoder.fitted,
    };
    match arguments.mode {
        Mode::InProcess => in_process(&simulation, &loaded, &output, &injections),
        Mode::Realtime => supervised(arguments, loaded, Pace::Realtime, injections, simulation),
        Mode::Lockstep => supervised(arguments, loaded, Pace::Lockstep, injections, simulation),
    }
}

/// Records a scenario in one thread and tells of it, as `simulate --mode in-process` does.
///
/// # Errors
/// As [`run`].
pub fn in_one_thread(loaded: &Loaded, output: &Output) -> Result<Outcome, Failure> {
    let simulation = Simulation {
        title: loaded.scenario.name.clone(),
        mode: Mode::InProcess,
        cycles: loaded.parts.timeline.last_cycle + 1,
        period_s: loaded.scenario.period_s(),
        begun_ns: now_ns(),
        out: output.folder().to_owned(),
        keep: Keep::All,
        json: false,
        injected: false,
        encoder: loaded.scenario.encoder.fitted,
    };
    in_process(&simulation, loaded, output, &[])
}

/// In one thread; without a record the summary's numbers come from the messages as they pass.
fn in_process(
    simulation: &Simulation,
    loaded: &Loaded,
    output: &Output,
    injections: &[Injection],
) -> Result<Outcome, Failure> {
    let mut summary = Summary::new(simulation);
    let run = in_process::Run { parts: &loaded.parts, injections, interruption: &Interruption::watch()? };
    let complete = if simulation.keep == Keep::All {
        let info = record_info(loaded, Mode::InProcess, "in-process");
        run.record(&info, &output.first_segment())?
    } else {
        let (metrics, complete) = run.measure();
        summary.take_metrics(&metrics);
        complete
    };
    tell(simulation, summary, output, complete)
}

fn supervised(
    arguments: &Arguments,
    loaded: Loaded,
    pace: Pace,
    injections: Vec<Injection>,
    simulation: Simulation,
) -> Result<Outcome, Failure> {
    let own = || format!("simulate-{}", std::process::id()).parse();
    let name = arguments
        .instance
        .clone()
        .map_or_else(own, Ok)
        .map_err(|error| Failure::Input(anyhow!("{error}")))?;
    let mission = Mission {
        pace,
        stays: false,
        absolute_encoder: loaded.scenario.encoder.absolute,
        timings: loaded.timings(),
        bridge: None,
        folder: arguments.out.clone(),
        keep: arguments.record,
        info: record_info(&loaded, arguments.mode, &name.to_string()),
        parts: loaded.parts,
        injections: arguments.allow_injection.then_some(injections),
        require_realtime: arguments.require_realtime,
        errand: Vec::new(),
        name,
    };
    hand_over(mission, &Errand::Simulate(simulation))
}

/// Takes over from the supervisor: makes run.h5 and run.html, and prints the summary.
///
/// # Errors
/// [`Failure::Failed`] where the run or its record failed.
pub fn conclude(simulation: &Simulation, ending: Ending) -> Result<Outcome, Failure> {
    let mut summary = Summary::new(simulation);
    summary.processes = by_process(&ending.processes);
    if ending.recorder_given_up {
        summary.record_flaws.extend(ending.lost_record());
    }
    summary.failure = ending.failure;
    summary.recorder_restarts = ending.recorder_restarts;
    tell(simulation, summary, &Output::of_run(&simulation.out), !ending.interrupted)
}

fn tell(
    simulation: &Simulation,
    mut summary: Summary,
    output: &Output,
    complete: bool,
) -> Result<Outcome, Failure> {
    summary.interrupted = !complete;
    summary.wall_s = now_ns().saturating_sub(simulation.begun_ns) as f64 / 1e9;
    if simulation.keep == Keep::All {
        take_record(output, &mut summary)?;
    }
    print(&summary, simulation.json)?;
    outcome(simulation, &summary)
}

/// The faults that were asked for.
fn injections(arguments: &Arguments) -> Result<Vec<Injection>, Failure> {
    let one = |text: &String| {
        let injection = Injection::parse(text).map_err(|error| Failure::Input(anyhow!("{error}")))?;
        let fits = match arguments.mode {
            Mode::Realtime => injection.fault.within().is_some(),
            Mode::Lockstep | Mode::InProcess => injection.fault.without_clock(),
        };
        if fits {
            return Ok(injection);
        }
        Err(Failure::Input(anyhow!(
            "fault {text:?} can't be planned {}: stepvalve inject does it to an instance",
            arguments.mode.name()
        )))
    };
    arguments.inject.iter().map(one).collect()
}

/// Turns the record into run.h5, that into run.html, and takes the summary's numbers from it.
fn take_record(output: &Output, summary: &mut Summary) -> Result<(), anyhow::Error> {
    let segments = output.segments();
    let mut metrics = Metrics::default();
    let report = read_record(&segments, |message| note(&mut metrics, message))?;
    summary.take_record(&metrics, &report);
    run_log::convert(&segments, &output.run_h5())?;
    report::write(&output.run_h5(), &output.run_html())?;
    summary.run_h5 = Some(output.run_h5());
    summary.run_html = Some(output.run_html());
    for (name, process) in &summary.processes {
        if let Some(error) = process.counts.as_ref().and_then(|counts| counts.recording_error.as_ref()) {
            summary.record_flaws.push(format!("{name}: {error}"));
        }
    }
    Ok(())
}

fn print(summary: &Summary, json: bool) -> Result<(), anyhow::Error> {
    if json {
        say(serde_json::to_string_pretty(summary)?);
    } else {
        say(summary);
    }
    Ok(())
}

fn outcome(simulation: &Simulation, summary: &Summary) -> Result<Outcome, Failure> {
    if let Some(failure) = &summary.failure {
        return Err(Failure::Failed(anyhow!("{failure}")));
    }
    if let Some(flaw) = summary.record_flaws.first() {
        return Err(Failure::Failed(anyhow!("the record is not whole: {flaw}")));
    }
    if summary.interrupted {
        return Ok(Outcome::Interrupted);
    }
    // Of a fault that was injected before, that is what was to be seen.
    if summary.never_ran() && !simulation.injected {
        return Err(Failure::Failed(anyhow!(
            "the valve never ran: it was not armed, which asks for a spool that stands still and a drive without fault in the scenario's \
             first cycles; run.html of a recorded run shows what it did"
        )));
    }
    Ok(if summary.fault.is_some() { Outcome::Fault } else { Outcome::Done })
}

//! `stepvalve simulate`: a scenario in closed loop, in one of three modes, to its end.

use crate::failure::{Failure, Outcome};
use crate::files::{self, Loaded};
use crate::in_process;
use crate::instance::Instance;
use crate::metrics::Metrics;
use crate::output::Output;
use crate::report;
use crate::run::parse_keep;
use crate::say::say;
use crate::signals::Interruption;
use crate::summary::Summary;
use crate::supervisor::{self, Setup};
use anyhow::anyhow;
use clap::ValueEnum;
use injection::Injection;
use processes::complain;
use processes::{Keep, Mode as Pace};
use recording::{RecordInfo, read_record};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// How to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// Separate processes, each on its own absolute deadlines
    Realtime,
    /// Separate processes that wait for each other: no clock, the same result every time
    Lockstep,
    /// One thread, as fast as it goes
    InProcess,
}

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
    instance: Option<String>,
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

/// Runs the scenario and prints the summary.
///
/// # Errors
/// [`Failure::Input`] before anything is started; [`Failure::Failed`] where the run or its record failed.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if matches!(arguments.record, Keep::Ring { .. }) {
        return Err(Failure::Input(anyhow!("--record takes none or all here: a scenario has an end")));
    }
    let injections = injections(arguments)?;
    let loaded = files::load(&arguments.scenario)?;
    for warning in loaded.scenario.warnings() {
        complain(format_args!("note: {warning}"));
    }
    let output = Output::prepare(&arguments.out)?;
    let interruption = Interruption::watch()?;
    let begun = Instant::now();
    let mut summary = summary(&loaded, arguments.mode);
    let complete = match arguments.mode {
        Mode::InProcess => in_process(arguments, &loaded, &output, &injections, &interruption, &mut summary)?,
        Mode::Realtime => {
            supervised(arguments, &loaded, Pace::Realtime, &output, &injections, &interruption, &mut summary)?
        }
        Mode::Lockstep => {
            supervised(arguments, &loaded, Pace::Lockstep, &output, &injections, &interruption, &mut summary)?
        }
    };
    summary.wall_s = begun.elapsed().as_secs_f64();
    if arguments.record == Keep::All {
        take_record(&output, &mut summary)?;
    }
    print(&summary, arguments.json)?;
    outcome(&summary, complete)
}

/// In one thread; without a record the summary's numbers come from the messages as they pass.
fn in_process(
    arguments: &Arguments,
    loaded: &Loaded,
    output: &Output,
    injections: &[Injection],
    interruption: &Interruption,
    summary: &mut Summary,
) -> Result<bool, Failure> {
    let run = in_process::Run { parts: &loaded.parts, injections, interruption };
    if arguments.record == Keep::All {
        let info = info(loaded, Mode::InProcess, "in-process");
        return Ok(run.record(&info, &output.first_segment())?);
    }
    let (metrics, complete) = run.measure();
    summary.take_metrics(&metrics);
    Ok(complete)
}

fn supervised(
    arguments: &Arguments,
    loaded: &Loaded,
    pace: Pace,
    output: &Output,
    injections: &[Injection],
    interruption: &Interruption,
    summary: &mut Summary,
) -> Result<bool, Failure> {
    let name = arguments.instance.clone().unwrap_or_else(|| format!("simulate-{}", std::process::id()));
    let instance = Instance::acquire(&name)?;
    let setup = Setup {
        instance: &instance,
        name: name.clone(),
        pace,
        loaded,
        output,
        keep: arguments.record,
        info: info(loaded, arguments.mode, &name),
        injections: arguments.allow_injection.then(|| injections.to_vec()),
        require_realtime: arguments.require_realtime,
        interruption: interruption.clone(),
    };
    let ending = supervisor::run(&setup)?;
    summary.processes = ending.processes;
    summary.failure = ending.failure;
    summary.recorder_restarts = ending.recorder_restarts;
    Ok(!ending.interrupted)
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
        let mode = mode_name(arguments.mode);
        Err(Failure::Input(anyhow!(
            "fault {text:?} can't be planned {mode}: stepvalve inject does it to an instance"
        )))
    };
    arguments.inject.iter().map(one).collect()
}

/// What a record says of itself.
pub fn info(loaded: &Loaded, mode: Mode, instance: &str) -> RecordInfo {
    // In lockstep and in process nothing may differ between two runs of one scenario.
    let live = mode == Mode::Realtime;
    let started = SystemTime::now().duration_since(UNIX_EPOCH).map(|since| since.as_nanos() as u64);
    RecordInfo {
        title: loaded.scenario.name.clone(),
        instance: if live { instance.to_owned() } else { String::new() },
        mode: mode_name(mode).to_owned(),
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
        generation: supervisor::generation_of(live),
        period_ns: loaded.scenario.period_ns,
        microstep_rad: Some(loaded.microstep_rad),
        started_unix_ns: started.ok().filter(|_| live),
        texts: loaded.texts.clone(),
        machine: realtime::machine_facts().into_iter().collect(),
    }
}

fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Realtime => "realtime",
        Mode::Lockstep => "lockstep",
        Mode::InProcess => "in-process",
    }
}

fn summary(loaded: &Loaded, mode: Mode) -> Summary {
    Summary {
        title: loaded.scenario.name.clone(),
        mode: mode_name(mode).to_owned(),
        cycles: loaded.parts.timeline.last_cycle + 1,
        period_s: loaded.scenario.period_s(),
        wall_s: 0.0,
        following_error_rad: None,
        true_following_error_rad: None,
        pulse_rate_peak_hz: 0.0,
        torque_reserve_min_nm: None,
        limiting_cycles: 0,
        lost_steps: 0,
        fault: None,
        fault_cycle: None,
        refused_set_points: BTreeMap::new(),
        recorded: 0,
        declared_missing: 0,
        record_flaws: Vec::new(),
        recorder_restarts: 0,
        failure: None,
        measured: false,
        processes: BTreeMap::new(),
        run_h5: None,
        run_html: None,
    }
}

/// Turns the record into run.h5, that into run.html, and takes the summary's numbers from it.
fn take_record(output: &Output, summary: &mut Summary) -> Result<(), anyhow::Error> {
    let segments = output.segments();
    let mut metrics = Metrics::default();
    let report = read_record(&segments, |message| metrics.note(message))?;
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

fn outcome(summary: &Summary, complete: bool) -> Result<Outcome, Failure> {
    if let Some(failure) = &summary.failure {
        return Err(Failure::Failed(anyhow!("{failure}")));
    }
    if let Some(flaw) = summary.record_flaws.first() {
        return Err(Failure::Failed(anyhow!("the record is not whole: {flaw}")));
    }
    if !complete {
        return Ok(Outcome::Interrupted);
    }
    Ok(if summary.fault.is_some() { Outcome::Fault } else { Outcome::Done })
}

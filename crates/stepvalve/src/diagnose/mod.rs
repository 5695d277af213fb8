//! `stepvalve diagnose`: measured runs against a model; what it gets wrong, why, and what that is worth.

mod causes;
mod explore;
pub mod fix;
mod leftover;
pub mod logs;
mod numbers;
mod page;
mod progress;
mod quality;
mod remains;
mod results;
mod runs;
mod suspects;
mod unnamed;

use crate::files::{self, name, names};
use crate::findings;
use crate::say::say;
use anyhow::Context;
use config::Scenario;
use diagnosis::{Options, Verdict};
use page::Material;
use processes::complain;
use progress::Progress;
use results::Results;
use std::path::{Path, PathBuf};
use std::time::Duration;
use study::experiment::{self, Range, Valve};
use study::{Answer, Case, Fixed, Question, Residuals, Threads, extended, words};
use supervisor::{Failure, Outcome};

/// What to hold against what.
#[derive(clap::Args)]
pub struct Arguments {
    /// Measured runs (valve-log, or the folder of a run): torque against angle, or angle against angle_command. Several logs are diagnosed as one
    #[arg(long = "log", value_name = "LOG.h5", required = true, num_args = 1..)]
    logs: Vec<PathBuf>,
    /// The model
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// The folder for diagnosis.json, model-extended.toml, residuals.h5 and report.html
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace the diagnosis that is in the folder
    #[arg(long)]
    force: bool,
    /// Leave a run out; of several logs it is called LOG:RUN
    #[arg(long, value_name = "RUN")]
    exclude: Vec<String>,
    /// A number of the model that is known exactly, SECTION.KEY=VALUE as in the model file (load.inertia_kg_m2=0.008), or of an
    /// effect that has but one, ID.KEY=VALUE (torque-offset.offset_nm=0): it is set, and is no cause
    #[arg(long, value_name = "PARAMETER=VALUE")]
    fix: Vec<String>,
    /// A law that you suspect, tried beside the causes of the list: 'torque += a*speed*abs(speed)', 'level *= 1 + ...' (of T_c
    /// and T_s) or 'viscous *= 1 + ...', in angle, speed, acceleration, time, pressure_drop (Pa), oil_temperature, time_at_rest
    /// and distance. All other names are parameters, which are fitted; '; b = 0.1' behind it says where. 'NAME:' before it is
    /// its name
    #[arg(long, value_name = "LAW")]
    hypothesis: Vec<String>,
    /// A file of such laws, with bounds and units of their parameters (docs/model.md)
    #[arg(long, value_name = "EFFECTS.toml")]
    effects: Option<PathBuf>,
    /// What the page is called; else as the log is
    #[arg(long)]
    title: Option<String>,
    /// Write a model for each cause of the groups that can't be told apart, too: model-ID.toml
    #[arg(long)]
    rivals: bool,
    /// Decides which runs are held out: the same seed, the same answer
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The measurement's noise where it is known (a filtered log shows less), RMS in N·m of a torque, rad of an angle;
    /// without, it is estimated from the log
    #[arg(long, value_name = "RMS", value_parser = noise)]
    noise: Option<f64>,
    /// How well the model's numbers are known, as a standard deviation in parts of each (of the torque's zero in parts of the
    /// Coulomb torque); corrections up to twice that are no cause. From 0 (exactly) to 0.25
    #[arg(long, value_name = "PART", default_value_t = 0.03, value_parser = tolerance)]
    tolerance: f64,
    /// Searches for so long at most, then concludes from what it has, such as 30s or 10min; what is said then may depend on the
    /// machine
    #[arg(long, value_name = "TIME", value_parser = limit, default_value = DEFAULT_LIMIT)]
    limit: Duration,
    /// The scenario whose limits the next experiment keeps, for a log of a commanded valve; without, no set-points are proposed
    #[arg(long, value_name = "SCENARIO.toml")]
    scenario: Option<PathBuf>,
    /// What the next experiment may do: angle, speed, acceleration, pressure_drop or oil_temperature with a range, such as
    /// pressure_drop=0MPa..16MPa; without, as far as the log went. Any number of them
    #[arg(long, value_name = "RANGE", value_parser = experiment::range)]
    within: Vec<Range>,
    /// The longest that the next experiment may take
    #[arg(long, value_name = "TIME", value_parser = limit, default_value = "60s")]
    experiment_time: Duration,
    /// Whether it is a step of an investigation: then it says less.
    #[arg(skip)]
    step: bool,
    #[arg(skip)]
    orders_alone: bool,
    #[arg(skip)]
    clock: logs::Clock,
}

/// What is simulated is bounded at about 40 s of two idle cores; a machine that is slow, or busy, comes to an end too. The conclusion takes
/// up to half as long again.
const DEFAULT_LIMIT: &str = "80s";

/// A time with its unit.
///
/// # Errors
/// What was found and expected.
pub fn limit(text: &str) -> Result<Duration, String> {
    let refused = || format!("found `{text}`, expected a time above zero with its unit: 500ms, 30s or 2min");
    let place = text.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(refused)?;
    let (number, unit) = text.split_at(place);
    let unit_s = match unit {
        "ms" => 1e-3,
        "s" => 1.0,
        "min" => 60.0,
        _ => return Err(refused()),
    };
    let number: f64 = number.trim().parse().map_err(|_| refused())?;
    Duration::try_from_secs_f64(number * unit_s).ok().filter(|limit| !limit.is_zero()).ok_or_else(refused)
}

/// A standard deviation in parts.
///
/// # Errors
/// What was found and expected.
pub fn tolerance(text: &str) -> Result<f64, String> {
    let refused = || format!("found `{text}`, expected a number from 0 to 0.25");
    text.parse().ok().filter(|part: &f64| (0.0..=0.25).contains(part)).ok_or_else(refused)
}

fn noise(text: &str) -> Result<f64, String> {
    let refused = || format!("found `{text}`, expected a number above zero");
    text.parse().ok().filter(|noise: &f64| noise.is_normal() && *noise > 0.0).ok_or_else(refused)
}

/// A diagnosis that is one step of an investigation.
pub struct Step {
    pub logs: Vec<PathBuf>,
    pub model: PathBuf,
    pub out: PathBuf,
    pub tolerance: f64,
    pub scenario: Option<PathBuf>,
    pub within: Vec<Range>,
    pub experiment_time: Duration,
    /// The longest that it may search.
    pub most: Duration,
    /// Whether the next experiment is made by orders to a running instance.
    pub orders_alone: bool,
    /// What is known of when the logs were made.
    pub clock: logs::Clock,
}

impl Arguments {
    /// Of a step, with the defaults of the command.
    pub fn of_a_step(step: Step) -> Self {
        let usual = limit(DEFAULT_LIMIT).unwrap_or(step.most);
        Self {
            logs: step.logs,
            model: step.model,
            out: step.out,
            force: true,
            exclude: Vec::new(),
            fix: Vec::new(),
            hypothesis: Vec::new(),
            effects: None,
            title: None,
            rivals: false,
            seed: 0,
            noise: None,
            tolerance: step.tolerance,
            limit: usual.min(step.most),
            scenario: step.scenario,
            within: step.within,
            experiment_time: step.experiment_time,
            step: true,
            orders_alone: step.orders_alone,
            clock: step.clock,
        }
    }
}

/// Diagnoses, writes all files when all is done, and tells what was found.
///
/// # Errors
/// As [`diagnosed`].
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    summary(&diagnosed(arguments)?, &arguments.out);
    Ok(Outcome::Done)
}

/// Diagnoses, and writes all files when all is done.
///
/// # Errors
/// [`Failure::Input`] where the log or the model can't be used, naming run and row, or files exist;
/// [`Failure::Failed`] where writing fails.
pub fn diagnosed(arguments: &Arguments) -> Result<Answer, Failure> {
    let results = Results::new(&arguments.out, arguments.force)?;
    let model_file = name(&arguments.model);
    let log_file = names(&arguments.logs);
    let of_log = |error: anyhow::Error| Failure::Input(error.context(log_file.clone()));
    let Fixed { model, effects: fixed } = fix::read(&arguments.model, &arguments.fix)?;
    let suspects = suspects::read(&arguments.hypothesis, arguments.effects.as_ref())?;
    let scenario = arguments.scenario.as_deref().map(read_scenario).transpose()?;
    let case = Case::new(logs::read_on(arguments.clock, &arguments.logs, &arguments.exclude)?, &model);
    let case = case.map_err(of_log)?;
    if !arguments.step {
        findings::show(&case.quality);
    }
    if model.load.is_none() {
        complain(
            "note: the model has no [load]: the inertia behind the transducer, or the motor, counts as none",
        );
    }
    let progress = Progress::new(words::unit(case.channel()), arguments.step);
    let (seed, noise, tolerance) = (arguments.seed, arguments.noise, arguments.tolerance);
    let question = Question {
        options: Options { seed, noise, tolerance, fixed, suspects },
        valve: scenario.as_ref().map(|scenario| valve(arguments, scenario)),
        within: &arguments.within,
        most_s: arguments.experiment_time.as_secs_f64(),
    };
    let threads = Threads::new(Some(arguments.limit));
    let answer = case.answer(&question, &threads, &mut |event| progress.show(event)).map_err(of_log)?;
    answer.told.iter().for_each(complain);
    progress.step("predicting every sample");
    let residuals = Residuals::of(&answer.log, &model, &answer.found).with_context(|| log_file.clone())?;
    progress.step("writing");
    let page = page::page(&Material {
        title: arguments.title.as_deref().unwrap_or(&answer.log.title),
        answer: &answer,
        residuals: &residuals,
        files: (&log_file, &model_file),
    });
    let mut texts = vec![
        ("diagnosis.json".to_owned(), answer.json()?),
        ("model-extended.toml".to_owned(), answer.extended(&model, &log_file, &model_file)),
        ("report.html".to_owned(), page),
    ];
    texts.extend(answer.next.iter().flat_map(|next| next.files.clone()));
    if arguments.rivals {
        texts.extend(extended::rivals(&answer.found, &model));
    }
    let write = |path: &Path| run_log::write_log(path, &residuals.beside(&answer.log)).context("residuals");
    results.write(&texts, write)?;
    progress.end();
    Ok(answer)
}

/// A scenario with its text.
fn read_scenario(path: &Path) -> Result<(String, Scenario), Failure> {
    let text = files::read(path)?;
    let scenario = config::parse_scenario(&text, &name(path)).map_err(Failure::input)?;
    Ok((text, scenario))
}

/// The valve of a scenario, for experiments: its models named wherever the experiment will lie.
fn valve<'a>(arguments: &Arguments, (text, scenario): &'a (String, Scenario)) -> Valve<'a> {
    let beside = |of: &String| {
        let path = files::beside(arguments.scenario.as_deref().unwrap_or(Path::new("")), of);
        name(&std::path::absolute(&path).unwrap_or(path))
    };
    Valve {
        scenario,
        text,
        models: (beside(&scenario.truth), beside(&scenario.belief)),
        sines: !arguments.orders_alone,
    }
}

fn summary(answer: &Answer, out: &Path) {
    let diagnosis = &answer.found.diagnosis;
    say(format_args!("{}: {}", diagnosis.verdict.name(), answer.headline()));
    for cause in &diagnosis.causes {
        say(format_args!("  {}: {}", cause.id, words::numbers(&cause.parameters)));
    }
    for law in &diagnosis.unnamed {
        say(format_args!("  {}, without a name: {}", law.id, study::unnamed::goes(law)));
    }
    for group in &diagnosis.ambiguous {
        let names: Vec<&str> = group.ids.iter().map(|id| id.name()).collect();
        say(format_args!("  can't be told apart: {}", names.join(", ")));
        if let Some(best) = &group.best {
            say(format_args!("  fitted best: {}: {}", best.id, words::numbers(&best.parameters)));
        }
    }
    for number in &diagnosis.within_tolerance {
        say(format_args!("  within tolerance: {}", words::corrected(number)));
    }
    for seen in diagnosis.nuisances.iter().chain(&diagnosis.observations) {
        say(format_args!("  seen: {seen}"));
    }
    words::first_guesses(diagnosis).iter().for_each(|guesses| say(format_args!("next: {guesses}")));
    let mend = study::quality::mend_first(&answer.quality);
    mend.iter().for_each(|mend| say(format_args!("next: {mend}")));
    if mend.is_empty() && diagnosis.verdict != Verdict::NoDiscrepancy {
        say(format_args!("next: {}", diagnosis.next_experiment));
    }
    say(format_args!(
        "{}, with model-extended.toml, diagnosis.json and residuals.h5",
        name(&out.join("report.html"))
    ));
}

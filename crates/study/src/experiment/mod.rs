//! The next experiment: what to run so that explanations that a log can't tell apart are told apart.

mod motion;
mod rig;
mod valve;
mod within;

use crate::threads::Threads;
use config::{Scenario, ScheduledSetPoint};
use diagnosis::{Choice, Contest, Found, Trial, choose, map};
use log_data::{Channel, Log};
use valve_model::Model;
use within::Machine;
pub use within::{Range, range};

/// The file that says what an experiment is.
pub const TOML_FILE: &str = "next-experiment.toml";
/// The file of its motion, for a rig.
pub const CSV_FILE: &str = "next-experiment.csv";

/// A sensor with this part of the noise is proposed where it would decide.
const BETTER: f64 = 0.1;

/// A valve that set-points can be given to.
pub struct Valve<'a> {
    /// The scenario whose limits it has.
    pub scenario: &'a Scenario,
    /// The scenario's text.
    pub text: &'a str,
    /// The truth and belief, as the experiment's scenario names them.
    pub models: (String, String),
    /// Whether sines can be asked for: a running instance takes angles and speeds alone.
    pub sines: bool,
}

/// What an experiment is to be for, and to keep within.
pub struct Asked<'a> {
    /// The log.
    pub log: &'a Log,
    /// The given model.
    pub model: &'a Model,
    /// The valve, where it is commanded.
    pub valve: Option<&'a Valve<'a>>,
    /// What the user allows.
    pub within: &'a [Range],
    /// The longest that it may take, s.
    pub most_s: f64,
}

/// An experiment.
pub struct Experiment {
    /// By name.
    pub files: Vec<(String, String)>,
    /// Whether it is expected to decide.
    pub decides: bool,
    /// What it is, in a sentence or two.
    pub said: String,
}

/// The experiment that tells the first group of a diagnosis apart, or a law without a name from those that do as well; `None` where neither is
/// open.
///
/// # Errors
/// Limits that leave no motion.
pub fn next(found: &Found, asked: &Asked<'_>) -> anyhow::Result<Option<Experiment>> {
    let Some(contest) = found.contests.first() else { return Ok(None) };
    let threads = Threads::new(None);
    if found.channel == Channel::Torque {
        return of_rig(contest, asked, &threads).map(Some);
    }
    match asked.valve {
        Some(valve) => of_valve(contest, asked, valve, &threads).map(Some),
        None => Ok(None),
    }
}

/// Motions that show a valve for the first time, those alone that a running instance takes.
pub fn first_motions(scenario: &Scenario, model: &Model, within: &[Range]) -> Vec<ScheduledSetPoint> {
    valve::scenario(scenario, &valve::parts(scenario, model, within, false)).set_points
}

fn of_rig(contest: &Contest, asked: &Asked<'_>, threads: &Threads) -> anyhow::Result<Experiment> {
    let machine = Machine::of(asked.log, asked.model, asked.within)?;
    let parts = rig::parts(&machine);
    let trials: Vec<Trial> = parts.iter().map(|part| part.trial(&machine)).collect();
    let choice = choose(contest, &trials, asked.most_s, threads);
    let chosen: Vec<&rig::Part> = choice.chosen.iter().filter_map(|index| parts.get(*index)).collect();
    let head = head(
        contest,
        &choice,
        takes_s(&choice, &trials),
        "format = \"stepvalve-experiment\"\nformat_version = 1\n",
    );
    let files = vec![
        (TOML_FILE.to_owned(), head + &rig::toml(&chosen, &machine)),
        (CSV_FILE.to_owned(), rig::csv(&chosen, &machine)),
    ];
    Ok(concluded(contest, (choice, &trials), asked.most_s, threads, files))
}

fn of_valve(
    contest: &Contest,
    asked: &Asked<'_>,
    valve: &Valve<'_>,
    threads: &Threads,
) -> anyhow::Result<Experiment> {
    let parts = valve::parts(valve.scenario, asked.model, asked.within, valve.sines);
    let made = map(threads, parts.len(), |index| {
        let part = *parts.get(index)?;
        Some((part, valve::trial(valve.scenario, asked.model, part)?))
    });
    let (parts, trials): (Vec<valve::Part>, Vec<Trial>) = made.into_iter().flatten().unzip();
    let choice = choose(contest, &trials, asked.most_s, threads);
    let chosen: Vec<valve::Part> =
        choice.chosen.iter().filter_map(|index| parts.get(*index).copied()).collect();
    let made = valve::scenario(valve.scenario, &chosen);
    let title = format!("to tell {} apart", names(contest));
    let models = (valve.models.0.as_str(), valve.models.1.as_str());
    let text = valve::text(valve.text, &made, models, &title)?;
    let files = vec![(TOML_FILE.to_owned(), head(contest, &choice, made.duration_s, "") + &text)];
    Ok(concluded(contest, (choice, &trials), asked.most_s, threads, files))
}

fn takes_s(choice: &Choice, trials: &[Trial]) -> f64 {
    choice.chosen.iter().filter_map(|index| trials.get(*index)).map(|trial| trial.takes_s).sum()
}

fn names(contest: &Contest) -> String {
    contest.labels().join(" from ")
}

/// A log Bayes factor; beyond a thousand only that it is.
fn factor(says: f64) -> String {
    if says > 1000.0 { "over 1000".to_owned() } else { format!("{says:.0}") }
}

/// What stands above an experiment.
fn head(contest: &Contest, choice: &Choice, takes_s: f64, format: &str) -> String {
    let labels = contest.labels();
    let label = |place: &usize| labels.get(*place).copied().unwrap_or_default();
    let pairs = choice
        .expected
        .iter()
        .map(|(one, other, says)| format!("#   {} from {}: {says:.1}\n", label(one), label(other)));
    format!(
        "# The next experiment, by stepvalve diagnose: tells {} apart. It takes {takes_s:.0} s.\n\
         # Expected log Bayes factors (10 is clear, {} is aimed at):\n{}{format}",
        names(contest),
        factor(choice.aim),
        pairs.collect::<String>()
    )
}

/// What is to be said of a choice; the files only where it decides.
fn concluded(
    contest: &Contest,
    (choice, trials): (Choice, &[Trial]),
    most_s: f64,
    threads: &Threads,
    files: Vec<(String, String)>,
) -> Experiment {
    let names = names(contest);
    let takes_s = takes_s(&choice, trials);
    if choice.decides() {
        let said = format!(
            "{TOML_FILE} holds {} runs, {takes_s:.0} s in all, that tell {names}: expected log Bayes factor {}",
            choice.chosen.len(),
            factor(choice.worst())
        );
        return Experiment { files, decides: true, said };
    }
    let better = choose(&contest.with_noise(BETTER), trials, most_s, threads).decides();
    let sensor = if better {
        "A sensor with a tenth of this one's noise would tell them apart (an encoder of ten times the counts)."
    } else {
        "A finer sensor would not tell them apart either: it takes another quantity, measured independently."
    };
    let said = format!(
        "{names} can't be told apart on this machine within {most_s:.0} s, whatever is run within its limits (an expected log Bayes factor \
         of {:.1} at best, 10 is asked for). {sensor}",
        choice.worst()
    );
    Experiment { files: Vec::new(), decides: false, said }
}

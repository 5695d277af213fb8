//! `stepvalve check`: is this file good?

use crate::say::say;
use crate::{campaign, files, loaded, new};
use config::Scenario;
use std::path::PathBuf;
use supervisor::{Failure, Outcome};

/// What to check.
#[derive(clap::Args)]
pub struct Arguments {
    /// A scenario (its models and its drive file are checked too), a model, a drive file, or a campaign's plan
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
}

/// Validates the file; says what is in it, or every error with line and column.
///
/// # Errors
/// [`Failure::Input`].
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let file = files::name(&arguments.file);
    let text = files::read(&arguments.file)?;
    if says_format(&text, "stepvalve-model") {
        let model = config::parse_model(&text, &file).map_err(Failure::input)?;
        say(format_args!("{file}: model \"{}\", friction law {}: good", model.name, model.friction.law()));
        if let Some(note) = new::untouched(&text) {
            say(format_args!("note: {note}"));
        }
        return Ok(Outcome::Done);
    }
    if says_format(&text, "stepvalve-drive") {
        let drive = config::parse_drive(&text, &file).map_err(Failure::input)?;
        say(format_args!(
            "{file}: drive \"{}\", {} units a revolution: good",
            drive.name, drive.units_per_rev
        ));
        return Ok(Outcome::Done);
    }
    if says_format(&text, "stepvalve-campaign") {
        let campaign = campaign::load(&arguments.file)?;
        say(format_args!("{file}: campaign \"{}\", {} runs: good", campaign.plan().name, campaign.runs()));
        return Ok(Outcome::Done);
    }
    let loaded = loaded::load(&arguments.file)?;
    let scenario = &loaded.scenario;
    say(format_args!(
        "{file}: scenario \"{}\", {} s at {} us, {} set-points, truth {}, belief {}: good",
        scenario.name,
        scenario.duration_s,
        scenario.period_ns / 1000,
        scenario.set_points.len(),
        scenario.truth,
        scenario.belief
    ));
    say(loaded.goes_on());
    if let Some(note) = new::untouched(&loaded.texts.belief) {
        say(format_args!("note: belief {}: {note}", scenario.belief));
    }
    for warning in scenario.warnings().into_iter().chain(missing_cores(scenario, &realtime::cores())) {
        say(format_args!("note: {warning}"));
    }
    Ok(Outcome::Done)
}

/// What is to run on a core that this machine doesn't have, or doesn't give us: the file may be for another one.
fn missing_cores(scenario: &Scenario, cores: &[usize]) -> Vec<String> {
    let timing = &scenario.timing;
    let plant = if scenario.drive.is_some() { "valve-bridge" } else { "plant-simulator" };
    let tasks = [
        (plant, timing.plant),
        ("trajectory-generator", timing.trajectory),
        ("step-controller", timing.controller),
        ("run-recorder", timing.recorder),
    ];
    let there: Vec<String> = cores.iter().map(usize::to_string).collect();
    let wanted = tasks.into_iter().filter_map(|(name, task)| Some((name, task.core?)));
    let missing = wanted.filter(|(_, core)| !cores.is_empty() && !cores.contains(core));
    missing
        .map(|(name, core)| {
            format!(
                "{name} is to stay on core {core}; here are cores {}, and it would run on any",
                there.join(", ")
            )
        })
        .collect()
}

/// Whether the file says that it has this format; what says none is read as a scenario, whose errors then say what is missing.
fn says_format(text: &str, format: &str) -> bool {
    text.lines().any(|line| {
        let mut sides = line.splitn(2, '=').map(str::trim);
        sides.next() == Some("format")
            && sides.next().is_some_and(|value| value.starts_with(&format!("\"{format}\"")))
    })
}

//! `stepvalve compensation`: what friction compensation is worth, measured over scenarios, levels and beliefs.

mod campaign;
mod cases;
mod cycle_time;
mod document;
pub mod measure;
mod response;
mod stick_slip;

use crate::failure::{Failure, Outcome as Ending};
use crate::files;
use crate::say::say;
use anyhow::{Context, anyhow};
use cases::{Case, Demand, asymmetric, sine, triangle};
use config::{Damping, parse_model, parse_scenario};
use document::Measured;
use measure::Level;
use response::{Setting, response};
use std::path::{Path, PathBuf};

/// What to measure and where to write it.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folder with the scenarios; sine-1hz.toml and step-sequence.toml must be among them
    #[arg(long, value_name = "DIR", default_value = "rt-config/scenarios")]
    scenarios: PathBuf,
    /// File for the tables, beside stdout
    #[arg(long, value_name = "FILE.md")]
    out: Option<PathBuf>,
}

/// Speeds of the triangles, in parts of the stick-slip speed.
const TRIANGLES: [f64; 6] = [4.0, 2.0, 1.2, 0.5, 0.2, 0.05];

/// Measures and prints.
///
/// # Errors
/// [`Failure::Input`] for scenarios that can't be read; [`Failure::Failed`] where the tables can't be written.
pub fn run(arguments: &Arguments) -> Result<Ending, Failure> {
    let mut cases = shipped(&arguments.scenarios)?;
    let like = named(&cases, "sine-1hz")?.clone();
    let stick_slip_rad_per_s = stick_slip::stick_slip_speed_rad_per_s(&like.truth).ok_or_else(|| {
        Failure::Input(anyhow!("sine-1hz: its truth never sticks, so there is nothing to measure"))
    })?;
    let triangles =
        TRIANGLES.iter().map(|part| triangle(&like, part * stick_slip_rad_per_s, stick_slip_rad_per_s));
    cases.extend(triangles);
    cases.extend([sine(&like, 0.05, 2.0), sine(&like, 0.05, 5.0), sine(&like, 0.02, 10.0)]);
    cases.push(asymmetric(&like).context("an effect")?);
    let findings = campaign::run_all(&cases)?;
    let (turning, stuck) = cases.into_iter().zip(findings).partition(|(case, _)| case.turns());
    let measured = Measured {
        cases: turning,
        stuck,
        stick_slip_rad_per_s,
        responses: responses(&like)?,
        cycle_times: vec![
            ("full law", cycle_time::cycle_time(&like, Level::FULL)?),
            ("full law, observer, active damping", cycle_time::cycle_time(&like, Level::OBSERVED)?),
        ],
    };
    let text = measured.text();
    say(&text);
    if let Some(path) = &arguments.out {
        std::fs::write(path, &text).with_context(|| files::name(path))?;
    }
    Ok(Ending::Done)
}

fn responses(like: &Case) -> anyhow::Result<Vec<(&'static str, Vec<f64>)>> {
    Ok(vec![
        ("command, no damping", response(like, Setting::Command(Damping::None))?),
        ("command, active", response(like, Setting::Command(Damping::Active))?),
        ("reference, no damping", response(like, Setting::Reference(Damping::None))?),
        ("reference, shaping", response(like, Setting::Reference(Damping::Shaping))?),
    ])
}

fn named<'a>(cases: &'a [Case], name: &str) -> Result<&'a Case, Failure> {
    let missing =
        || Failure::Input(anyhow!("no scenario {name}.toml there, which the generated ones are made from"));
    cases.iter().find(|case| case.name == name).ok_or_else(missing)
}

/// The scenarios of a folder in the order of their names.
fn shipped(folder: &Path) -> Result<Vec<Case>, Failure> {
    let entries = std::fs::read_dir(folder).with_context(|| files::name(folder)).map_err(Failure::Input)?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    paths.iter().map(|path| case(path)).collect()
}

fn case(path: &Path) -> Result<Case, Failure> {
    let file = files::name(path);
    let scenario = parse_scenario(&files::read(path)?, &file).map_err(Failure::input)?;
    let truth_path = path.parent().unwrap_or(Path::new("")).join(&scenario.truth);
    let truth = parse_model(&files::read(&truth_path)?, &files::name(&truth_path)).map_err(Failure::input)?;
    let name = path.file_stem().map_or(file, |stem| stem.to_string_lossy().into_owned());
    let demand = match name.as_str() {
        "sine-1hz" | "step-sequence" => Demand::BeliefAlone,
        _ => Demand::Encoder,
    };
    Ok(Case { name, scenario, truth, demand })
}

//! `bench compensation`: what friction compensation is worth, measured over scenarios, levels and beliefs.

mod campaign;
mod cases;
mod cycle_time;
mod document;
mod response;
mod stick_slip;

use anyhow::{Context, Result, anyhow};
use cases::{Case, Demand, asymmetric, sine, triangle};
use closed_loop::Level;
use config::{Damping, parse_model, parse_scenario};
use document::Measured;
use response::{Setting, response};
use std::path::{Path, PathBuf};

/// What to measure and where to write it.
#[derive(Debug, Clone, clap::Args)]
pub struct Arguments {
    /// Folder with the scenarios; sine-1hz.toml and step-sequence.toml must be among them
    #[arg(long, value_name = "DIR", default_value = "rt-config/scenarios")]
    scenarios: PathBuf,
    /// File for the tables, beside stdout
    #[arg(long, value_name = "FILE.md")]
    file: Option<PathBuf>,
}

/// Speeds of the triangles, in parts of the stick-slip speed.
const TRIANGLES: [f64; 6] = [4.0, 2.0, 1.2, 0.5, 0.2, 0.05];

/// Measures and prints.
///
/// # Errors
/// Scenarios that can't be read; a file that can't be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut cases = shipped(&arguments.scenarios)?;
    let like = named(&cases, "sine-1hz")?.clone();
    let stick_slip_rad_per_s = stick_slip::stick_slip_speed_rad_per_s(&like.truth)
        .context("sine-1hz: its truth never sticks, so there is nothing to measure")?;
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
    println!("{text}");
    if let Some(path) = &arguments.file {
        std::fs::write(path, &text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

fn responses(like: &Case) -> Result<Vec<(&'static str, Vec<f64>)>> {
    Ok(vec![
        ("command, no damping", response(like, Setting::Command(Damping::None))?),
        ("command, active", response(like, Setting::Command(Damping::Active))?),
        ("reference, no damping", response(like, Setting::Reference(Damping::None))?),
        ("reference, shaping", response(like, Setting::Reference(Damping::Shaping))?),
    ])
}

fn named<'a>(cases: &'a [Case], name: &str) -> Result<&'a Case> {
    let named = cases.iter().find(|case| case.name == name);
    named.with_context(|| format!("no scenario {name}.toml there, which the generated ones are made from"))
}

/// The scenarios of a folder in the order of their names.
fn shipped(folder: &Path) -> Result<Vec<Case>> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    let mut cases = paths.iter().map(|path| case(path)).collect::<Result<Vec<_>>>()?;
    // A real drive has no simulated valve.
    cases.retain(|case| case.scenario.drive.is_none());
    Ok(cases)
}

fn case(path: &Path) -> Result<Case> {
    let file = path.display().to_string();
    let scenario = parse_scenario(&read(path)?, &file).map_err(|errors| anyhow!("{errors}"))?;
    let truth_path = path.parent().unwrap_or(Path::new("")).join(&scenario.truth);
    let truth = parse_model(&read(&truth_path)?, &truth_path.display().to_string());
    let truth = truth.map_err(|errors| anyhow!("{errors}"))?;
    let name = path.file_stem().map_or(file, |stem| stem.to_string_lossy().into_owned());
    let demand = match name.as_str() {
        "sine-1hz" | "step-sequence" => Demand::BeliefAlone,
        _ => Demand::Encoder,
    };
    Ok(Case { name, scenario, truth, demand })
}

fn read(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).with_context(|| path.display().to_string())
}

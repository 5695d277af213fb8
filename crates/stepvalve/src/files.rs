//! Scenario and model files: read here and nowhere else, checked before anything is started.

use crate::drive;
use anyhow::{Context, anyhow};
use closed_loop::{Parts, wire};
use config::{ConfigErrors, Scenario, belief_warnings, check_against_models, parse_model, parse_scenario};
use processes::{BridgePart, TaskTiming, complain};
use recording::Texts;
use std::io::Read;
use std::path::{Path, PathBuf};
use supervisor::{Failure, Timings};
use valve_model::Model;

/// No configuration file is longer, in bytes.
const MAX_BYTES: u64 = 1 << 20;

/// A scenario with its models, checked together.
pub struct Loaded {
    /// The scenario.
    pub scenario: Scenario,
    /// The micro-step of the plant's motor, rad.
    pub microstep_rad: f64,
    /// What each process is told.
    pub parts: Parts,
    /// The real drive in the simulated plant's place; `None` without one.
    pub bridge: Option<BridgePart>,
    /// All three texts.
    pub texts: Texts,
}

impl Loaded {
    /// When and where each process runs.
    pub fn timings(&self) -> Timings {
        let of = |task: config::TaskTiming| TaskTiming {
            phase_ns: task.phase_ns,
            core: task.core,
            priority: task.priority,
        };
        let timing = &self.scenario.timing;
        Timings {
            plant: TaskTiming {
                phase_ns: self
                    .bridge
                    .as_ref()
                    .map_or(timing.plant.phase_ns, |bridge| bridge.params.place_ns.into()),
                ..of(timing.plant)
            },
            trajectory: of(timing.trajectory),
            controller: of(timing.controller),
            recorder: of(timing.recorder),
        }
    }
}

/// Reads and checks a scenario and the models that it names.
///
/// # Errors
/// [`Failure::Input`] with every error of the first file that has any.
pub fn load(path: &Path) -> Result<Loaded, Failure> {
    let text = read(path)?;
    let scenario = parse_scenario(&text, &name(path)).map_err(input)?;
    let (truth_path, belief_path) = (beside(path, &scenario.truth), beside(path, &scenario.belief));
    let truth_text = read(&truth_path)?;
    let belief_text = read(&belief_path)?;
    let truth = parse_model(&truth_text, &name(&truth_path)).map_err(input)?;
    let belief = parse_model(&belief_text, &name(&belief_path)).map_err(input)?;
    for warning in belief_warnings(&scenario, &belief) {
        complain(format_args!("note: {warning}"));
    }
    let texts = Texts { scenario: text, truth: truth_text, belief: belief_text };
    let mut loaded = assemble(scenario, &truth, &belief, texts, &name(path))?;
    if let Some(drive) = &loaded.scenario.drive {
        loaded.bridge = Some(drive::load(path, drive, &loaded)?);
    }
    Ok(loaded)
}

/// The same from texts that a record carries.
///
/// # Errors
/// As [`load`].
pub fn load_texts(texts: &Texts) -> Result<Loaded, Failure> {
    let scenario = parse_scenario(&texts.scenario, "the record's scenario").map_err(input)?;
    let truth = parse_model(&texts.truth, "the record's truth").map_err(input)?;
    let belief = parse_model(&texts.belief, "the record's belief").map_err(input)?;
    assemble(scenario, &truth, &belief, texts.clone(), "the record's scenario")
}

fn assemble(
    scenario: Scenario,
    truth: &Model,
    belief: &Model,
    texts: Texts,
    file: &str,
) -> Result<Loaded, Failure> {
    check_against_models(&scenario, truth, belief, &texts.scenario, file).map_err(input)?;
    let parts = wire(&scenario, truth, belief).with_context(|| file.to_owned()).map_err(Failure::Input)?;
    let microstep_rad = parts.plant.drive.microstep_angle_rad;
    Ok(Loaded { scenario, microstep_rad, parts, bridge: None, texts })
}

/// Reads a text file of bounded size.
///
/// # Errors
/// [`Failure::Input`] where it can't be read, is too long, or is not UTF-8.
pub fn read(path: &Path) -> Result<String, Failure> {
    let file = std::fs::File::open(path).with_context(|| name(path)).map_err(Failure::Input)?;
    let mut text = String::new();
    let read = file
        .take(MAX_BYTES + 1)
        .read_to_string(&mut text)
        .with_context(|| name(path))
        .map_err(Failure::Input)?;
    if read as u64 > MAX_BYTES {
        return Err(Failure::Input(anyhow!(
            "{}: longer than {MAX_BYTES} bytes, which no scenario or model is",
            name(path)
        )));
    }
    Ok(text)
}

/// Temporary files are their owner's alone; results are for everybody that the folder lets in.
///
/// # Errors
/// Where the system refuses.
pub fn let_all_read(file: &std::fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

/// A path as messages show it.
pub fn name(path: &Path) -> String {
    path.display().to_string()
}

pub fn beside(path: &Path, other: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(other)
}

fn input(errors: ConfigErrors) -> Failure {
    Failure::input(errors)
}

//! A scenario with all files that it names: read here and nowhere else, checked before anything is started.

use crate::{drive, files};
use anyhow::Context;
use closed_loop::{Parts, wire};
use config::{Scenario, belief_warnings, check_against_models, parse_model, parse_scenario};
use processes::{BridgePart, TaskTiming, complain};
use recording::Texts;
use std::path::Path;
use supervisor::{Failure, Timings};
use valve_model::Model;

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
            early_ns: self.scenario.timing.early_ns,
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

impl Loaded {
    /// How far the valve goes on where its controller dies at full speed: until the silence is noticed, and down the ramp.
    pub fn goes_on(&self) -> String {
        let Scenario { safety, driver, limits, .. } = &self.scenario;
        let silence_s = (safety.silence_cycles + 1) as f64 * self.scenario.period_ns as f64 * 1e-9;
        let speed = limits.max_speed_rad_per_s;
        let ramp_s = speed / (driver.quick_stop_deceleration_hz_per_s * self.microstep_rad);
        let further_rad = speed * (silence_s + 0.5 * ramp_s);
        format!(
            "where the controller dies at full speed ({:.0}°/s) the valve stands after {:.0} ms at most, {:.1}° further \
             (silence_cycles = {})",
            speed.to_degrees(),
            (1e3 * (silence_s + ramp_s)).ceil(),
            (10.0 * further_rad.to_degrees()).ceil() / 10.0,
            safety.silence_cycles
        )
    }
}

/// Reads and checks a scenario and the models that it names.
///
/// # Errors
/// [`Failure::Input`] with every error of the first file that has any.
pub fn load(path: &Path) -> Result<Loaded, Failure> {
    let text = files::read(path)?;
    let scenario = parse_scenario(&text, &files::name(path)).map_err(Failure::input)?;
    let (truth_path, belief_path) =
        (files::beside(path, &scenario.truth), files::beside(path, &scenario.belief));
    let model = |key: &str, named: &Path| {
        files::read(named).map_err(|failure| match failure {
            Failure::Input(error) => Failure::Input(error.context(place(&text, key, &files::name(path)))),
            other => other,
        })
    };
    let truth_text = model("truth", &truth_path)?;
    let belief_text = model("belief", &belief_path)?;
    let truth = parse_model(&truth_text, &files::name(&truth_path)).map_err(Failure::input)?;
    let belief = parse_model(&belief_text, &files::name(&belief_path)).map_err(Failure::input)?;
    for warning in belief_warnings(&scenario, &belief) {
        complain(format_args!("note: {warning}"));
    }
    let texts = Texts { scenario: text, truth: truth_text, belief: belief_text };
    let mut loaded = assemble(scenario, &truth, &belief, texts, &files::name(path))?;
    if let Some(drive) = &loaded.scenario.drive {
        loaded.bridge = Some(drive::load(path, drive, &loaded.scenario, &loaded.parts)?);
    }
    Ok(loaded)
}

/// Where a scenario names a model: file, line, column and key, as in other errors.
fn place(text: &str, key: &str, file: &str) -> String {
    let begins = |line: &&str| line.split_once('=').is_some_and(|(name, _)| name.trim() == key);
    let found = text.lines().enumerate().find(|(_, line)| begins(line));
    let at = found.and_then(|(line, text)| Some((line + 1, text.find('=')? + 3)));
    at.map_or(format!("{file}: {key}"), |(line, column)| format!("{file}:{line}:{column}: {key}"))
}

/// The same from texts that a record carries.
///
/// # Errors
/// As [`load`].
pub fn load_texts(texts: &Texts) -> Result<Loaded, Failure> {
    let scenario = parse_scenario(&texts.scenario, "the record's scenario").map_err(Failure::input)?;
    let truth = parse_model(&texts.truth, "the record's truth").map_err(Failure::input)?;
    let belief = parse_model(&texts.belief, "the record's belief").map_err(Failure::input)?;
    assemble(scenario, &truth, &belief, texts.clone(), "the record's scenario")
}

fn assemble(
    scenario: Scenario,
    truth: &Model,
    belief: &Model,
    texts: Texts,
    file: &str,
) -> Result<Loaded, Failure> {
    check_against_models(&scenario, truth, belief, &texts.scenario, file).map_err(Failure::input)?;
    let parts = wire(&scenario, truth, belief).with_context(|| file.to_owned()).map_err(Failure::Input)?;
    let microstep_rad = parts.plant.drive.microstep_angle_rad;
    Ok(Loaded { scenario, microstep_rad, parts, bridge: None, texts })
}

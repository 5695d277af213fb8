//! `stepvalve predict`: what the model has for measured runs.

use crate::files::{self, name, room_for};
use crate::pulse::Pulse;
use crate::say::say;
use crate::strangers;
use anyhow::{Context, anyhow};
use indicatif::ProgressBar;
use log_data::{Attribute, Channel, Log, Run};
use prediction::{Predicted, Start};
use run_log::{Late, RunLogError};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver};
use study::{Done, Task, predict_all, take_tasks};
use supervisor::{Failure, Outcome};
use valve_model::Model;

/// What to predict.
#[derive(clap::Args)]
pub struct Arguments {
    /// Measured runs (valve-log), or a run's folder: with torque, it is predicted from the angle, else the angle from angle_command. (`diagnose`
    /// prefers the angle where the model has a motor.)
    #[arg(long, value_name = "LOG.h5")]
    log: PathBuf,
    /// The model
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// The file to write: the same runs and times, `torque` or `angle` predicted
    #[arg(long, value_name = "PRED.h5")]
    out: PathBuf,
    /// Replace the file that is there
    #[arg(long)]
    force: bool,
}

/// Predicts every run, several at a time, and writes each as soon as it is there.
///
/// # Errors
/// [`Failure::Input`] where the log or the model can't be used, naming run and row, or the output exists;
/// [`Failure::Failed`] where writing fails. No file is left then.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let out = &arguments.out;
    room_for(out, arguments.force)?;
    let log_path = files::run_file(&arguments.log)?;
    if is_same_file(out, &log_path) {
        return Err(Failure::Input(anyhow!("{} is the log: give --out another name", name(out))));
    }
    let (model_file, log_file) = (name(&arguments.model), name(&log_path));
    let model = config::parse_model(&files::read(&arguments.model)?, &model_file).map_err(Failure::input)?;
    let mut log = strangers::log(&log_path)?;
    let tasks = take_tasks(&mut log).with_context(|| log_file.clone()).map_err(Failure::Input)?;
    log.title = format!("Prediction: {}", log.title);
    log.provenance = Some(format!("stepvalve predict, log {log_file}, model {model_file} ({})", model.name));
    let predicted = predict_and_write(out, &log, &model, tasks).map_err(|failure| match failure {
        Failure::Input(error) => Failure::Input(error.context(log_file.clone())),
        Failure::Failed(error) => Failure::Failed(error),
    })?;
    for (run, written) in log.runs.iter().zip(&predicted) {
        say(summary(run, written));
    }
    say(format_args!("{}: {} runs predicted with \"{}\"", name(out), log.runs.len(), model.name));
    say(format_args!("how far off: stepvalve compare {log_file} {} --out compare.html", name(out)));
    Ok(Outcome::Done)
}

fn is_same_file(one: &Path, other: &Path) -> bool {
    matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}

/// Writes the runs in their order, each while later ones are being predicted; tells what was done with them.
fn predict_and_write(
    out: &Path,
    log: &Log,
    model: &Model,
    tasks: Vec<Task>,
) -> Result<Vec<Written>, Failure> {
    let progress = ProgressBar::new(log.runs.len() as u64);
    let (done, runs) = (progress.clone(), log.runs.len());
    let pulse = Pulse::new(move || format!("{} of {runs} runs predicted", done.position()));
    let written = std::thread::scope(|scope| {
        let (sender, done) = mpsc::channel();
        let progress = &progress;
        scope.spawn(move || {
            predict_all(log, model, tasks, &sender, &|| progress.inc(1));
        });
        write(out, log, done)
    });
    drop(pulse);
    progress.finish_and_clear();
    written
}

/// Takes the tasks as they are done, in any order. It drops `done` when it ends, and with it whoever still works for it.
fn write(out: &Path, log: &Log, done: Receiver<Done>) -> Result<Vec<Written>, Failure> {
    let mut early: BTreeMap<usize, (Task, Predicted)> = BTreeMap::new();
    let mut all = Vec::new();
    let mut late = |index| -> Result<Late, Failure> {
        let (task, predicted) = loop {
            if let Some(done) = early.remove(&index) {
                break done;
            }
            let (task, predicted) =
                done.recv().context("predicting ended too early")?.map_err(Failure::input)?;
            early.insert(task.index, (task, predicted));
        };
        all.push(Written { predicted, source: task.follows(), bridged: task.bridged });
        Ok(Late { channel: task.channel, values: task.values, attributes: attributes(&predicted) })
    };
    run_log::write_log_with_late(out, log, |index| late(index).map_err(Stopped))
        .map_err(|stopped| stopped.0)?;
    Ok(all)
}

/// What is told of a run that was written.
struct Written {
    predicted: Predicted,
    /// The channel that the model followed, and how many samples of it are missing.
    source: Channel,
    bridged: usize,
}

/// Why the file was not finished: the prediction's own failure, or one of writing.
struct Stopped(Failure);

impl From<RunLogError> for Stopped {
    fn from(error: RunLogError) -> Self {
        Self(Failure::Failed(error.into()))
    }
}

/// What became of a run, for whoever reads the file.
fn attributes(predicted: &Predicted) -> BTreeMap<String, Attribute> {
    let mut attributes = BTreeMap::new();
    attributes.insert("predicted".to_owned(), Attribute::Text(predicted.channel.name().to_owned()));
    let start = match predicted.start {
        Start::Estimated { deflection_rad, came_from_rad } => {
            let mut say = |key: &str, number| attributes.insert(key.to_owned(), Attribute::Number(number));
            say("initial_bristle_deflection_rad", deflection_rad);
            if came_from_rad != 0.0 {
                say("initial_bristle_came_from_rad", came_from_rad);
            }
            "estimated"
        }
        Start::LeftOut => "left out",
    };
    attributes.insert("initial_bristle_state".to_owned(), Attribute::Text(start.to_owned()));
    attributes
}

fn summary(run: &Run, Written { predicted, source, bridged }: &Written) -> String {
    let steps = match predicted.noise.step_rad {
        0.0 => "no encoder steps".to_owned(),
        step_rad => format!("encoder steps of {step_rad:.3e} rad"),
    };
    let left_out = match predicted.left_out {
        0 => String::new(),
        samples => format!(", the first {samples} left out: no torque to begin from"),
    };
    let gaps = match bridged {
        0 => String::new(),
        samples => format!(", {samples} without {source}: nothing is predicted there"),
    };
    format!(
        "{}: {} from {source}, {} samples, {steps}{left_out}{gaps}",
        run.name,
        predicted.channel,
        run.len()
    )
}

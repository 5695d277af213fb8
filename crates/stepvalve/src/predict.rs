//! `stepvalve predict`: what the model has for measured runs.

use crate::failure::{Failure, Outcome};
use crate::files::{self, name};
use crate::say::say;
use anyhow::{Context, anyhow};
use indicatif::ProgressBar;
use log_data::{Attribute, Channel, Log, Run};
use prediction::{Past, Predicted, PredictionError, Start, depends_on_past, predict, predicted_channel};
use std::num::NonZero;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use valve_model::Model;

/// What to predict.
#[derive(clap::Args)]
pub struct Arguments {
    /// Measured runs (valve-log): with torque, it is predicted from the angle; else the angle from angle_command
    #[arg(long, value_name = "LOG.h5")]
    log: PathBuf,
    /// The model
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// The file to write: the same runs and times, `torque` or `angle` predicted
    #[arg(long, value_name = "PRED.h5")]
    out: PathBuf,
}

/// Predicts every run, several at a time, and writes them when all are done.
///
/// # Errors
/// [`Failure::Input`] where the log or the model can't be used, naming run and row, or the output exists;
/// [`Failure::Failed`] where writing fails.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let out = &arguments.out;
    if out.exists() {
        return Err(Failure::Input(anyhow!("{} exists: give --out another name", name(out))));
    }
    let (model_file, log_file) = (name(&arguments.model), name(&arguments.log));
    let model = config::parse_model(&files::read(&arguments.model)?, &model_file).map_err(Failure::input)?;
    let mut log = run_log::read_log(&arguments.log).map_err(Failure::input)?;
    let checked = log.runs.iter().try_for_each(|run| predicted_channel(run).map(|_| ()));
    checked.with_context(|| log_file.clone()).map_err(Failure::Input)?;
    // What the model doesn't know needs no memory from here on.
    log.runs.iter_mut().for_each(|run| run.extra = Vec::new());
    let predicted =
        predict_all(&mut log, &model).with_context(|| log_file.clone()).map_err(Failure::Input)?;
    for (run, predicted) in log.runs.iter_mut().zip(&predicted) {
        describe(run, predicted);
        say(summary(run, predicted));
    }
    log.title = format!("Prediction: {}", log.title);
    log.provenance = Some(format!("stepvalve predict, log {log_file}, model {model_file} ({})", model.name));
    run_log::write_log(out, &log).with_context(|| name(out))?;
    say(format_args!("{}: {} runs predicted with \"{}\"", name(out), log.runs.len(), model.name));
    Ok(Outcome::Done)
}

fn predict_all(log: &mut Log, model: &Model) -> Result<Vec<Predicted>, PredictionError> {
    let progress = ProgressBar::new(log.runs.len() as u64);
    let predicted = if depends_on_past(model) {
        one_after_the_other(log, model, &progress)
    } else {
        side_by_side(log, model, &progress)
    };
    progress.finish_and_clear();
    predicted
}

/// For a model with a memory: in the order of time, each run with what the ones before left, rests in between included.
fn one_after_the_other(
    log: &mut Log,
    model: &Model,
    progress: &ProgressBar,
) -> Result<Vec<Predicted>, PredictionError> {
    let one_clock = log.is_on_one_clock();
    let mut runs: Vec<(usize, &mut Run)> = log.runs.iter_mut().enumerate().collect();
    runs.sort_by(|a, b| a.1.start_s().total_cmp(&b.1.start_s()));
    let (mut past, mut ended_s) = (Past::default(), None);
    let mut done = Vec::new();
    for (index, run) in runs {
        if let Some(ended_s) = ended_s.filter(|_| one_clock) {
            past.rest_s += run.start_s() - ended_s;
        }
        let predicted = predict(run, model, &past)?;
        (past, ended_s) = (predicted.end, Some(run.end_s()));
        done.push((index, predicted));
        progress.inc(1);
    }
    done.sort_by_key(|(index, _)| *index);
    Ok(done.into_iter().map(|(_, predicted)| predicted).collect())
}

/// As many runs at a time as there are processors.
fn side_by_side(
    log: &mut Log,
    model: &Model,
    progress: &ProgressBar,
) -> Result<Vec<Predicted>, PredictionError> {
    let workers = std::thread::available_parallelism().map_or(1, NonZero::get).min(log.runs.len());
    let queue = Mutex::new(log.runs.iter_mut().enumerate());
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
                while let Some((index, run)) = next() {
                    let predicted = predict(run, model, &Past::default());
                    done.lock().unwrap_or_else(PoisonError::into_inner).push((index, predicted));
                    progress.inc(1);
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, predicted)| predicted).collect()
}

/// What became of a run, for whoever reads the file.
fn describe(run: &mut Run, predicted: &Predicted) {
    run.attributes.insert("predicted".to_owned(), Attribute::Text(predicted.channel.name().to_owned()));
    let start = match predicted.start {
        Start::Estimated { deflection_rad } => {
            let key = "initial_bristle_deflection_rad".to_owned();
            run.attributes.insert(key, Attribute::Number(deflection_rad));
            "estimated"
        }
        Start::LeftOut => "left out",
    };
    run.attributes.insert("initial_bristle_state".to_owned(), Attribute::Text(start.to_owned()));
}

fn summary(run: &Run, predicted: &Predicted) -> String {
    let source = match predicted.channel {
        Channel::Torque => "angle",
        _ => "angle_command",
    };
    let steps = match predicted.noise.step_rad {
        0.0 => "no encoder steps".to_owned(),
        step_rad => format!("encoder steps of {step_rad:.3e} rad"),
    };
    let left_out = match predicted.left_out {
        0 => String::new(),
        samples => format!(", the first {samples} left out: no torque to begin from"),
    };
    format!("{}: {} from {source}, {} samples, {steps}{left_out}", run.name, predicted.channel, run.len())
}

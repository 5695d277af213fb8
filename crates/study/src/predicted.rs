//! All runs of a log through a model, several at a time.
//!
//! This is what `stepvalve predict` does, too.

use log_data::{Channel, Log, Run, bridged_run};
use prediction::{Past, Predicted, PredictionError, depends_on_past, predict_taken, predicted_channel};
use std::num::NonZero;
use std::sync::mpsc::{self, Sender};
use std::sync::{Mutex, PoisonError};
use valve_model::Model;

/// What is to be predicted of a run: its place in the log, and a channel of its.
pub struct Task {
    /// The run's place in the log.
    pub index: usize,
    /// What is predicted.
    pub channel: Channel,
    /// As measured before, the model's afterwards; NaN where what the model follows was missing.
    pub values: Vec<f64>,
    /// Samples that are missing in what the model follows, and were bridged for it by straight lines.
    pub bridged: usize,
}

impl Task {
    fn new(index: usize, channel: Channel, values: Vec<f64>) -> Self {
        Self { index, channel, values, bridged: 0 }
    }

    /// The channel that the model follows.
    pub fn follows(&self) -> Channel {
        if self.channel == Channel::Torque { Channel::Angle } else { Channel::AngleCommand }
    }

    fn predict(&mut self, run: &Run, model: &Model, past: &Past) -> Result<Predicted, PredictionError> {
        let predicted = predict_taken(&bridged_run(run), self.channel, &mut self.values, model, past)?;
        let followed = run.channel(self.follows()).unwrap_or_default();
        for (value, _) in self.values.iter_mut().zip(followed).filter(|(_, followed)| followed.is_nan()) {
            *value = f64::NAN;
            self.bridged += 1;
        }
        Ok(predicted)
    }
}

/// A task that is done, its values the model's, or could not be.
pub type Done = Result<(Task, Predicted), PredictionError>;

/// Takes out of each run what is to be predicted.
///
/// # Errors
/// A run of which nothing can be predicted.
pub fn take_tasks(log: &mut Log) -> Result<Vec<Task>, PredictionError> {
    let channels = log.runs.iter().map(predicted_channel).collect::<Result<Vec<_>, _>>()?;
    let taken = log.runs.iter_mut().zip(channels).enumerate().map(|(index, (run, channel))| {
        Task::new(index, channel, run.take_channel(channel).unwrap_or_default())
    });
    Ok(taken.collect())
}

/// One channel of all runs, of a log that is still needed whole: with copies.
fn tasks(log: &Log, channel: Channel) -> Vec<Task> {
    let task = |(index, run): (usize, &Run)| {
        Task::new(index, channel, run.channel(channel).unwrap_or_default().to_vec())
    };
    log.runs.iter().enumerate().map(task).collect()
}

/// Predicts all tasks, hands over each as it is done, in any order, and says so.
pub fn predict_all(
    log: &Log,
    model: &Model,
    tasks: Vec<Task>,
    done: &Sender<Done>,
    one_more: &(dyn Fn() + Sync),
) {
    if depends_on_past(model) {
        one_after_the_other(log, model, tasks, done, one_more);
    } else {
        side_by_side(log, model, tasks, done, one_more);
    }
}

/// For a model with a memory: in the order of time, each run with what the ones before left, rests in between included.
fn one_after_the_other(
    log: &Log,
    model: &Model,
    mut tasks: Vec<Task>,
    done: &Sender<Done>,
    one_more: &(dyn Fn() + Sync),
) {
    let one_clock = log.is_on_one_clock();
    let run_of = |task: &Task| log.runs.get(task.index);
    let start_s = |task: &Task| run_of(task).map_or(f64::NAN, Run::start_s);
    tasks.sort_by(|a, b| start_s(a).total_cmp(&start_s(b)));
    let (mut past, mut ended_s) = (Past::default(), None);
    for mut task in tasks {
        let Some(run) = run_of(&task) else { continue };
        if let Some(ended_s) = ended_s.filter(|_| one_clock) {
            past.rest_s += run.start_s() - ended_s;
        }
        let predicted = task.predict(run, model, &past);
        if let Ok(predicted) = &predicted {
            (past, ended_s) = (predicted.end, Some(run.end_s()));
        }
        let failed = predicted.is_err();
        let told = done.send(predicted.map(|predicted| (task, predicted)));
        if failed || told.is_err() {
            return;
        }
        one_more();
    }
}

/// As many runs at a time as there are processors.
fn side_by_side(
    log: &Log,
    model: &Model,
    tasks: Vec<Task>,
    done: &Sender<Done>,
    one_more: &(dyn Fn() + Sync),
) {
    let workers = std::thread::available_parallelism().map_or(1, NonZero::get).min(tasks.len());
    let queue = Mutex::new(tasks.into_iter());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            let (queue, done) = (&queue, done.clone());
            scope.spawn(move || {
                let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
                while let Some(mut task) = next() {
                    let Some(run) = log.runs.get(task.index) else { continue };
                    let past = Past::default();
                    let predicted = task.predict(run, model, &past);
                    if done.send(predicted.map(|predicted| (task, predicted))).is_err() {
                        return;
                    }
                    one_more();
                }
            });
        }
    });
}

/// Tasks with the model's values, in the log's order. After each `goes_on` is asked, with how many there are; where it says no, the
/// others are left out.
///
/// # Errors
/// A run that can't be predicted.
pub fn predicted(
    log: &Log,
    model: &Model,
    tasks: Vec<Task>,
    goes_on: &mut dyn FnMut(usize) -> bool,
) -> Result<Vec<Task>, PredictionError> {
    let mut all = Vec::with_capacity(tasks.len());
    let (sender, done) = mpsc::channel::<Done>();
    std::thread::scope(|scope| {
        scope.spawn(move || predict_all(log, model, tasks, &sender, &|| ()));
        // Dropped early, it ends whoever still predicts.
        for one in done {
            let (task, _) = one?;
            all.push(task);
            if !goes_on(all.len()) {
                break;
            }
        }
        Ok(())
    })?;
    all.sort_by_key(|task| task.index);
    Ok(all)
}

/// One channel of all runs as a model has it, in the log's order.
///
/// # Errors
/// A run that can't be predicted.
pub(crate) fn predictions(
    log: &Log,
    channel: Channel,
    model: &Model,
) -> Result<Vec<Vec<f64>>, PredictionError> {
    let all = predicted(log, model, tasks(log, channel), &mut |_| true)?;
    Ok(all.into_iter().map(|task| task.values).collect())
}

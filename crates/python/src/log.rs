//! Measured runs: from numpy's arrays and back, and what a model has for them.

use crate::errors::{refused, refused_because};
use crate::model::Model;
use crate::work::beside_python;
use log_data::{AngleZero, Channel, Extra, Run};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use study::{Task, predicted, take_tasks};

/// A run as Python gives it: name, kind, channels, and signals that models don't know with their units.
type GivenRun<'py> = (
    String,
    String,
    Vec<(String, PyReadonlyArray1<'py, f64>)>,
    Vec<(String, String, PyReadonlyArray1<'py, f64>)>,
);

/// A channel that is predicted, and its values.
type PredictedRun<'py> = (&'static str, Bound<'py, PyArray1<f64>>);

/// Measured runs on one clock.
#[pyclass(frozen, module = "stepvalve._stepvalve")]
#[derive(Debug, Clone)]
pub(crate) struct Log {
    pub(crate) log: log_data::Log,
    /// As files that it goes into name it.
    pub(crate) name: String,
}

#[pymethods]
impl Log {
    #[new]
    fn new(name: String, title: String, angle_zero: &str, runs: Vec<GivenRun<'_>>) -> PyResult<Self> {
        let angle_zero = AngleZero::from_name(angle_zero).ok_or_else(|| {
            refused_because(format!("angle_zero: found {angle_zero:?}, expected \"common\" or \"per-run\""))
        })?;
        let runs = runs.into_iter().map(run).collect::<PyResult<_>>()?;
        let log = log_data::Log { title, angle_zero, runs, ..log_data::Log::default() };
        log.check().map_err(refused)?;
        Ok(Self { log, name })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    #[getter]
    fn title(&self) -> &str {
        &self.log.title
    }

    #[getter]
    fn angle_zero(&self) -> &'static str {
        self.log.angle_zero.name()
    }

    /// Of each run its name, its kind and its columns: name, unit, values.
    #[expect(clippy::type_complexity, reason = "a tuple is what Python unpacks")]
    fn runs<'py>(
        &self,
        py: Python<'py>,
    ) -> Vec<(String, String, Vec<(String, String, Bound<'py, PyArray1<f64>>)>)> {
        let column = |name: &str, unit: &str, values: &[f64]| {
            (name.to_owned(), unit.to_owned(), PyArray1::from_slice(py, values))
        };
        let columns = |run: &Run| {
            let known =
                Channel::ALL.iter().filter_map(|of| Some(column(of.name(), of.unit(), run.channel(*of)?)));
            let extra = run.extra.iter().map(|extra| column(&extra.name, &extra.unit, &extra.values));
            known.chain(extra).collect()
        };
        self.log.runs.iter().map(|run| (run.name.clone(), run.kind.clone(), columns(run))).collect()
    }
}

fn run((name, kind, channels, extra): GivenRun<'_>) -> PyResult<Run> {
    let mut run = Run { name: name.clone(), kind, ..Run::default() };
    for (of, values) in channels {
        let channel = Channel::from_name(&of)
            .ok_or_else(|| refused_because(format!("run {name}: found {of}, which is no channel")))?;
        run.set_channel(channel, values.as_array().to_vec());
    }
    for (of, unit, values) in extra {
        run.extra.push(Extra { name: of, unit, values: values.as_array().to_vec() });
    }
    Ok(run)
}

/// Of each run, in the log's order, the channel that the model predicts, and its values.
#[pyfunction]
pub(crate) fn predict<'py>(
    py: Python<'py>,
    log: &Log,
    model: &Model,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<PredictedRun<'py>>> {
    let mut log = log.log.clone();
    let tasks = take_tasks(&mut log).map_err(refused)?;
    let count = tasks.len();
    let predicted = beside_python(py, progress, |work| {
        predicted(&log, &model.model, tasks, &mut |done| {
            work.tell("predicting", Some(done as f64 / count as f64));
            !work.is_over()
        })
    })?;
    let array = |task: Task| (task.channel.name(), PyArray1::from_vec(py, task.values));
    Ok(predicted.map_err(refused)?.into_iter().map(array).collect())
}

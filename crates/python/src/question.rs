//! A log held against a model: the whole answer, as `stepvalve diagnose` has it.

use crate::errors::{refused, refused_because};
use crate::log::Log;
use crate::model::Model;
use crate::scenario::Scenario;
use crate::work::{Work, beside_python};
use diagnosis::{Event, Options};
use numpy::PyArray1;
use pyo3::prelude::*;
use std::time::Duration;
use study::experiment::{Range, Valve, range};
use study::{Answer, Case, Fixed, LawFile, Question, Residuals, Threads, extended, fixed, prepare, suspects};

/// What a diagnosis found.
#[pyclass(frozen, module = "stepvalve._stepvalve")]
pub(crate) struct Diagnosis {
    answer: Answer,
    given: valve_model::Model,
    log_name: String,
    model_file: String,
}

#[pymethods]
impl Diagnosis {
    fn json(&self) -> PyResult<String> {
        self.answer.json().map_err(refused)
    }

    fn headline(&self) -> String {
        self.answer.headline()
    }

    fn extended_text(&self) -> String {
        self.answer.extended(&self.given, &self.log_name, &self.model_file)
    }

    /// The models of causes that can't be told apart, by the files' names.
    fn rivals(&self) -> Vec<(String, String)> {
        extended::rivals(&self.answer.found, &self.given)
    }

    /// The files of the next experiment.
    fn experiment(&self) -> Vec<(String, String)> {
        self.answer.next.iter().flat_map(|next| next.files.clone()).collect()
    }

    /// The log as it was read.
    fn log(&self) -> Log {
        Log { log: self.answer.log.clone(), name: self.log_name.clone() }
    }

    /// The channel that is predicted, and of each run its samples: predicted by the given and by the extended model, standard
    /// deviation of the difference to the latter.
    #[expect(clippy::type_complexity, reason = "a tuple is what Python unpacks")]
    fn predictions<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(&'static str, Vec<(String, [Bound<'py, PyArray1<f64>>; 3])>)> {
        let Answer { found, log, .. } = &self.answer;
        let residuals = py.detach(|| Residuals::of(log, &self.given, found)).map_err(refused)?;
        let array = |values: Vec<f64>| PyArray1::from_vec(py, values);
        let runs =
            log.runs.iter().zip(residuals.runs).map(|(run, of)| {
                (run.name.clone(), [array(of.before), array(of.after), array(of.deviation)])
            });
        Ok((residuals.channel.name(), runs.collect()))
    }
}

/// What may be asked beside log and model.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Asked {
    exclude: Vec<String>,
    fix: Vec<String>,
    hypotheses: Vec<String>,
    effects: Option<(String, String)>,
    seed: u64,
    noise: Option<f64>,
    tolerance: f64,
    limit_s: Option<f64>,
    within: Vec<String>,
    experiment_s: f64,
}

/// Holds a log against a model.
#[pyfunction]
pub(crate) fn diagnose(
    py: Python<'_>,
    log: &Log,
    model: &Model,
    asked: Asked,
    scenario: Option<&Scenario>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Diagnosis> {
    let Fixed { model: given, effects } = fixed(&model.text, &model.file, &asked.fix).map_err(refused)?;
    let laws = asked.effects.as_ref().map(|(file, text)| LawFile { file, text });
    let suspects = suspects(&asked.hypotheses, laws).map_err(refused)?;
    let within: Vec<Range> = asked
        .within
        .iter()
        .map(|text| range(text).map_err(|error| refused_because(format!("within: {error}"))))
        .collect::<PyResult<_>>()?;
    let limit = asked.limit_s.map(Duration::try_from_secs_f64).transpose();
    let limit =
        limit.map_err(|error| refused_because(format!("limit: {error}, expected a time above zero, s")))?;
    let (noise, tolerance) = (positive("noise", asked.noise)?, asked.tolerance);
    if !(0.0..=0.25).contains(&tolerance) {
        return Err(refused_because(format!(
            "tolerance: found {tolerance}, expected a number from 0 to 0.25"
        )));
    }
    let question = Question {
        options: Options { seed: asked.seed, noise, tolerance, fixed: effects, suspects },
        valve: scenario.map(valve),
        within: &within,
        most_s: positive("experiment_time", Some(asked.experiment_s))?.unwrap_or_default(),
    };
    let mut measured = log.log.clone();
    prepare(&mut measured, &asked.exclude).map_err(refused)?;
    let answer = beside_python(py, progress, |work| {
        let threads = Threads::new(limit).stopped_by(&work.stop);
        let mut tell = |event: Event<'_>| told(work, &event);
        Case::new(measured, &given)?.answer(&question, &threads, &mut tell)
    })?;
    let answer = answer.map_err(|error| refused(error.context(log.name.clone())))?;
    Ok(Diagnosis { answer, given, log_name: log.name.clone(), model_file: model.file.clone() })
}

/// The valve of a scenario, for experiments.
fn valve(scenario: &Scenario) -> Valve<'_> {
    Valve {
        scenario: &scenario.scenario,
        text: &scenario.text,
        models: (scenario.truth.file.clone(), scenario.belief.file.clone()),
        sines: true,
    }
}

fn positive(name: &str, number: Option<f64>) -> PyResult<Option<f64>> {
    match number {
        Some(found) if !(found.is_finite() && found > 0.0) => {
            Err(refused_because(format!("{name}: found {found}, expected a number above zero")))
        }
        number => Ok(number),
    }
}

fn told(work: &Work, event: &Event<'_>) {
    match event {
        Event::Step(step) | Event::Again(step) => work.tell(*step, None),
        Event::Bound { simulated, at_most } => {
            work.tell("searching", Some(*simulated as f64 / (*at_most).max(1) as f64));
        }
        Event::Noise { rms, noise } => {
            work.tell(format!("error of the model: RMS {rms:.3e}; noise {noise:.3e}"), None);
        }
        _ => {}
    }
}

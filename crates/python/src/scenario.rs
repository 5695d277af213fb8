//! A scenario with its models, and its run in one thread.

use crate::errors::{refused, refused_because};
use crate::model::{Model, changed, value};
use crate::work::beside_python;
use campaign::{Metric, MotionMetrics, Row};
use closed_loop::{InProcess, Metrics, Parts, RunSignal, RunTable, wire};
use config::{belief_warnings, check_against_models, parse_scenario};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// So often a run looks whether it is to be given up, and says where it is.
const CYCLES_BETWEEN_LOOKS: u64 = 4096;

/// A scenario: the timing, the driver, the encoder and the set-points of a run, with the models of the plant and of the controller.
#[pyclass(frozen, module = "stepvalve._stepvalve")]
#[derive(Debug, Clone)]
pub(crate) struct Scenario {
    pub(crate) text: String,
    pub(crate) file: String,
    pub(crate) scenario: config::Scenario,
    pub(crate) truth: Model,
    pub(crate) belief: Model,
}

#[pymethods]
impl Scenario {
    #[new]
    fn new(text: String, file: String, truth: Model, belief: Model) -> PyResult<Self> {
        let scenario = parse_scenario(&text, &file).map_err(refused)?;
        if scenario.drive.is_some() {
            return Err(refused_because(format!(
                "{file}: found a real drive in [drive], expected a simulated valve"
            )));
        }
        check_against_models(&scenario, &truth.model, &belief.model, &text, &file).map_err(refused)?;
        Ok(Self { text, file, scenario, truth, belief })
    }

    /// The files that a scenario's text names as truth and belief.
    #[staticmethod]
    fn models_of(text: &str, file: &str) -> PyResult<(String, String)> {
        let scenario = parse_scenario(text, file).map_err(refused)?;
        Ok((scenario.truth, scenario.belief))
    }

    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    #[getter]
    fn file(&self) -> &str {
        &self.file
    }

    #[getter]
    fn name(&self) -> &str {
        &self.scenario.name
    }

    #[getter]
    fn period_s(&self) -> f64 {
        self.scenario.period_s()
    }

    #[getter]
    fn duration_s(&self) -> f64 {
        self.scenario.duration_s
    }

    #[getter]
    fn truth(&self) -> Model {
        self.truth.clone()
    }

    #[getter]
    fn belief(&self) -> Model {
        self.belief.clone()
    }

    fn warnings(&self) -> Vec<String> {
        let mut warnings = self.scenario.warnings();
        warnings.extend(belief_warnings(&self.scenario, &self.belief.model));
        warnings
    }

    fn get<'py>(&self, py: Python<'py>, path: &str) -> PyResult<Bound<'py, PyAny>> {
        value(py, &self.text, &self.file, path)
    }

    fn changed(&self, changes: Vec<(String, Bound<'_, PyAny>)>) -> PyResult<Self> {
        let text = changed(&self.text, &self.file, &changes)?;
        Self::new(text, self.file.clone(), self.truth.clone(), self.belief.clone())
    }

    fn with_models(&self, truth: Model, belief: Model) -> PyResult<Self> {
        Self::new(self.text.clone(), self.file.clone(), truth, belief)
    }
}

impl Scenario {
    fn parts(&self) -> PyResult<Parts> {
        wire(&self.scenario, &self.truth.model, &self.belief.model).map_err(refused)
    }
}

/// Columns by name, each with its unit and values; the run's metrics beside them.
type Simulated<'py> = (Vec<(&'static str, &'static str, Bound<'py, PyArray1<f64>>)>, Bound<'py, PyDict>);

/// Runs a scenario to its end, without a clock.
#[pyfunction]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    scenario: &Scenario,
    progress: Option<Py<PyAny>>,
) -> PyResult<Simulated<'py>> {
    let parts = scenario.parts()?;
    let last = parts.timeline.last_cycle.max(1) as f64;
    let (columns, metrics) = beside_python(py, progress, |work| {
        let (mut table, mut metrics) = (RunTable::new(parts.timeline.period_ns), Metrics::default());
        let mut cycles = InProcess::new(&parts);
        // `cycles.cycle()` would be the iterator's.
        while let Some(outputs) = InProcess::cycle(&mut cycles) {
            metrics.note_cycle(&outputs);
            table.note(&outputs);
            if outputs.cycle.is_multiple_of(CYCLES_BETWEEN_LOOKS) {
                work.tell("simulating", Some(outputs.cycle as f64 / last));
                if work.is_over() {
                    break;
                }
            }
        }
        (table.columns(), metrics)
    })?;
    let array = |column: RunSignal| (column.name, column.unit, PyArray1::from_vec(py, column.values));
    Ok((columns.into_iter().map(array).collect(), told(py, &metrics)?))
}

/// The metrics by the names that a campaign's table has for them.
fn told<'py>(py: Python<'py>, metrics: &Metrics) -> PyResult<Bound<'py, PyDict>> {
    let motion = MotionMetrics::new(metrics);
    let (fault, cycle, alarms) = (motion.fault_name(), motion.fault_cycle, motion.alarms);
    let row = Row { run: 0, motion: Some(motion), diagnosed: None, failure: None };
    let told = PyDict::new(py);
    for metric in Metric::ALL {
        told.set_item(metric.name(), metric.of(&row))?;
    }
    told.set_item("fault", fault)?;
    told.set_item("fault_cycle", cycle)?;
    told.set_item("alarms", alarms)?;
    Ok(told)
}

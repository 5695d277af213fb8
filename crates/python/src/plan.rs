//! A campaign: a plan with its texts, its runs as rows, and rows as columns.

use crate::errors::{refused, refused_because};
use crate::work::{Work, beside_python};
use campaign::log::{self, Head};
use campaign::{BaseTexts, Column, Row, Source, Values, columns};
use config::parse_plan;
use diagnosis::map;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList};
use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use study::Threads;

/// A scenario with its models: file and text of each.
type GivenBase = ((String, String), (String, String), (String, String));

/// The files of the scenarios that a plan names.
#[pyfunction]
pub(crate) fn plan_scenarios(text: &str, file: &str) -> PyResult<Vec<String>> {
    let plan = parse_plan(text, file).map_err(refused)?;
    Ok(plan.scenarios.into_iter().map(|named| named.text).collect())
}

/// A plan that fits its scenarios.
#[pyclass(frozen, module = "stepvalve._stepvalve")]
pub(crate) struct Campaign {
    campaign: campaign::Campaign,
    head: Head,
}

#[pymethods]
impl Campaign {
    #[new]
    fn new(plan: (String, String), bases: Vec<GivenBase>, build: &str) -> PyResult<Self> {
        let source = |(file, text): (String, String)| Source { file, text };
        let base = |(scenario, truth, belief)| BaseTexts {
            scenario: source(scenario),
            truth: source(truth),
            belief: source(belief),
        };
        let campaign = campaign::Campaign::new(source(plan), bases.into_iter().map(base).collect());
        let campaign = campaign.map_err(refused)?;
        let head = Head::new(&campaign, &format!("{} for Python, build {build}", env!("CARGO_PKG_VERSION")));
        Ok(Self { campaign, head })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.campaign.plan().name
    }

    #[getter]
    fn runs(&self) -> u64 {
        self.campaign.runs()
    }

    #[getter]
    fn failures_allowed(&self) -> u64 {
        self.campaign.failures_allowed()
    }

    fn warnings(&self) -> Vec<String> {
        self.campaign.warnings()
    }

    /// Scenario, truth and belief of a run as texts.
    fn texts(&self, run: u64) -> PyResult<(String, String, String)> {
        let texts = self.campaign.texts(run).ok_or_else(|| {
            refused_because(format!(
                "found no run {run}, expected one from 0 to {}",
                self.campaign.runs() - 1
            ))
        })?;
        Ok((texts.scenario.text, texts.truth.text, texts.belief.text))
    }

    /// What a log of rows begins with.
    fn head<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &log::begin(&self.head).map_err(refused)?))
    }

    /// Makes runs, so many at a time; their rows as bytes.
    fn make(
        &self,
        py: Python<'_>,
        runs: Vec<u64>,
        jobs: Option<NonZero<usize>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Vec<Py<PyBytes>>> {
        let made = beside_python(py, progress, |work| {
            let threads = Threads::new(None);
            self.rows(&runs, &jobs.map_or(threads.clone(), |jobs| threads.so_many(jobs)), work)
        })?;
        let bytes = made.iter().map(|row| Ok(PyBytes::new(py, &log::row(row).map_err(refused)?).unbind()));
        bytes.collect()
    }

    /// The runs that a log of rows holds, and how many of them failed.
    fn held(&self, rows: &[u8]) -> PyResult<(Vec<u64>, usize)> {
        let rows = self.read(rows)?;
        let failed = rows.iter().filter(|row| row.failure.is_some()).count();
        Ok((rows.iter().map(|row| row.run).collect(), failed))
    }

    /// A log of rows as columns: name, unit, values.
    fn columns<'py>(
        &self,
        py: Python<'py>,
        rows: &[u8],
    ) -> PyResult<Vec<(String, String, Bound<'py, PyAny>)>> {
        let of = columns(&self.campaign, &self.read(rows)?);
        of.into_iter().map(|column| array(py, column)).collect()
    }
}

impl Campaign {
    /// The rows of runs; none of those that were given up.
    fn rows(&self, runs: &[u64], threads: &Threads, work: &Work) -> Vec<Row> {
        let made = AtomicUsize::new(0);
        let rows = map(threads, runs.len(), |index| {
            let run = runs.get(index).filter(|_| !work.is_over())?;
            let row = self.campaign.run(*run, &|| work.is_over())?;
            let made = made.fetch_add(1, Ordering::Relaxed) + 1;
            work.tell("simulating runs", Some(made as f64 / runs.len() as f64));
            Some(row)
        });
        rows.into_iter().flatten().collect()
    }

    /// The rows of a log, in the order of their runs; it is of this campaign.
    fn read(&self, bytes: &[u8]) -> PyResult<Vec<Row>> {
        let contents = log::read(bytes).map_err(refused)?;
        let differences = contents.head.differences(&self.head);
        if !differences.is_empty() {
            return Err(refused_because(format!(
                "the rows are of another campaign: {}",
                differences.join("; ")
            )));
        }
        Ok(contents.rows.into_values().filter(|row| row.run < self.campaign.runs()).collect())
    }
}

fn array(py: Python<'_>, column: Column) -> PyResult<(String, String, Bound<'_, PyAny>)> {
    let values = match column.values {
        Values::Numbers(numbers) => PyArray1::from_vec(py, numbers).into_any(),
        Values::Counts(counts) => PyArray1::from_vec(py, counts).into_any(),
        Values::Texts(texts) => PyList::new(py, texts)?.into_any(),
    };
    Ok((column.name, column.unit, values))
}

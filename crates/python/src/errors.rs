//! Wrong input as a Python exception, with every finding's file, line and column.

use campaign::CampaignError;
use config::{ConfigError, ConfigErrors};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

pyo3::create_exception!(
    stepvalve,
    InputError,
    PyValueError,
    "Something is wrong with what was given. The message says what was found, where, and what was expected.\n\n\
     `problems` has the same of a scenario, model or plan as a list of dicts: file, line and column (from 1), key, found, expected."
);

/// An error of the library.
pub(crate) fn refused(error: impl Into<anyhow::Error>) -> PyErr {
    let error = error.into();
    let problems = error
        .chain()
        .find_map(|cause| match cause.downcast_ref::<CampaignError>() {
            Some(CampaignError::Plan(errors)) => Some(errors.clone()),
            _ => cause.downcast_ref::<ConfigErrors>().map(|errors| errors.errors().to_vec()),
        })
        .unwrap_or_default();
    Python::attach(|py| with_problems(py, &said(&error), &problems)).unwrap_or_else(|error| error)
}

/// What is refused in the package's own words.
pub(crate) fn refused_because(why: impl Into<String>) -> PyErr {
    refused(anyhow::anyhow!(why.into()))
}

fn with_problems(py: Python<'_>, message: &str, problems: &[ConfigError]) -> PyResult<PyErr> {
    let error = InputError::new_err(message.to_owned());
    let listed = problems.iter().map(|problem| {
        let entry = PyDict::new(py);
        entry.set_item("file", &problem.file)?;
        entry.set_item("line", problem.line)?;
        entry.set_item("column", problem.column)?;
        entry.set_item("key", &problem.key)?;
        entry.set_item("found", &problem.found)?;
        entry.set_item("expected", &problem.expected)?;
        Ok(entry)
    });
    let listed: Vec<Bound<'_, PyDict>> = listed.collect::<PyResult<_>>()?;
    error.value(py).setattr("problems", listed)?;
    Ok(error)
}

/// The error with what it happened in; a cause that says the same as what holds it is said once.
fn said(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if !text.ends_with(&cause) {
            text = if text.is_empty() { cause } else { format!("{text}: {cause}") };
        }
    }
    text
}

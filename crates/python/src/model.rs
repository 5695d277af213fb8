//! A model: its text, checked, and with numbers changed.

use crate::errors::{refused, refused_because};
use config::{Editable, Setting, parse_model};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyFloat, PyInt, PyString};

/// A model of the valve: what friction, load, motor and orifice are.
#[pyclass(frozen, from_py_object, module = "stepvalve._stepvalve")]
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(crate) text: String,
    pub(crate) file: String,
    pub(crate) model: valve_model::Model,
}

#[pymethods]
impl Model {
    #[new]
    pub(crate) fn new(text: String, file: String) -> PyResult<Self> {
        let model = parse_model(&text, &file).map_err(refused)?;
        Ok(Self { text, file, model })
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
        &self.model.name
    }

    /// The paths of all values that can be changed.
    fn paths(&self) -> Vec<String> {
        Editable::new(&self.text).unwrap_or_default().paths()
    }

    fn get<'py>(&self, py: Python<'py>, path: &str) -> PyResult<Bound<'py, PyAny>> {
        value(py, &self.text, &self.file, path)
    }

    fn changed(&self, changes: Vec<(String, Bound<'_, PyAny>)>) -> PyResult<Self> {
        Self::new(changed(&self.text, &self.file, &changes)?, self.file.clone())
    }
}

/// The value at a path of a text.
pub(crate) fn value<'py>(py: Python<'py>, text: &str, file: &str, path: &str) -> PyResult<Bound<'py, PyAny>> {
    let editable = Editable::new(text).unwrap_or_default();
    match editable.get(path) {
        Some(Setting::Number { number, unit }) if unit.is_empty() => Ok(PyFloat::new(py, number).into_any()),
        Some(Setting::Flag(flag)) => Ok(PyBool::new(py, flag).to_owned().into_any()),
        Some(shown) => Ok(PyString::new(py, &shown.shown()).into_any()),
        None => Err(unknown(&editable, file, path)),
    }
}

/// A text with values changed, each a number, a truth value or a text such as "17deg".
pub(crate) fn changed(text: &str, file: &str, changes: &[(String, Bound<'_, PyAny>)]) -> PyResult<String> {
    let editable = Editable::new(text).unwrap_or_default();
    let changes = changes
        .iter()
        .map(|(path, value)| Ok((path.as_str(), setting(path, value)?)))
        .collect::<PyResult<Vec<_>>>()?;
    for (path, setting) in &changes {
        if editable.with([(*path, setting)]).is_none() {
            return Err(unknown(&editable, file, path));
        }
    }
    editable
        .with(changes.iter().map(|(path, setting)| (*path, setting)))
        .ok_or_else(|| refused_because(format!("{file}: these changes don't go together")))
}

fn setting(path: &str, value: &Bound<'_, PyAny>) -> PyResult<Setting> {
    if value.is_instance_of::<PyBool>() {
        return Ok(Setting::Flag(value.extract()?));
    }
    if let Ok(text) = value.extract::<String>() {
        return Ok(Setting::of_text(&text));
    }
    if value.is_instance_of::<PyFloat>() || value.is_instance_of::<PyInt>() || value.hasattr("__float__")? {
        return Ok(Setting::Number { number: value.extract()?, unit: String::new() });
    }
    let found = value.get_type().name()?;
    Err(refused_because(format!("{path}: found a {found}, expected a number, a text or a truth value")))
}

fn unknown(editable: &Editable, file: &str, path: &str) -> PyErr {
    refused_because(format!(
        "{file}: found no {path}, expected a path such as {}",
        editable.alike(path).join(", ")
    ))
}

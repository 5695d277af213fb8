//! The native part of the Python package: models, scenarios, logs, simulation, prediction, diagnosis and campaigns for numpy.
//!
//! Thin on purpose: what is computed is computed in the crates that the command line uses too, so that both answer alike bit for bit; what
//! a Python user likes (pandas, defaults, docstrings) is in `python/stepvalve/`. No HDF5 is linked: h5py has its own.
#![forbid(unsafe_code)]

mod errors;
mod log;
mod model;
mod plan;
mod question;
mod scenario;
mod units;
mod work;

use pyo3::prelude::*;

#[pymodule]
mod _stepvalve {
    #[pymodule_export]
    use super::errors::InputError;
    #[pymodule_export]
    use super::log::{Log, predict};
    #[pymodule_export]
    use super::model::Model;
    #[pymodule_export]
    use super::plan::{Campaign, plan_scenarios};
    #[pymodule_export]
    use super::question::{Diagnosis, diagnose};
    #[pymodule_export]
    use super::scenario::{Scenario, simulate};
    #[pymodule_export]
    use super::units::to_si;

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("VERSION", env!("CARGO_PKG_VERSION"))
    }
}

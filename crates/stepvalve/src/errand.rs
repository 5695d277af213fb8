//! What `simulate` and `run` leave with the supervisor, to be given back when the valve stands.

use crate::record_info::Mode;
use processes::Keep;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use supervisor::{Failure, Mission, Outcome, begin};

/// What is to be told, and where.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Errand {
    /// Of a simulation.
    Simulate(Simulation),
    /// Of an instance that stayed.
    Run {
        /// The folder of its record.
        out: PathBuf,
        /// For machines.
        json: bool,
    },
}

/// A simulation under way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Simulation {
    /// The scenario's name.
    pub title: String,
    /// How it is run.
    pub mode: Mode,
    /// Cycles of the plant.
    pub cycles: u64,
    /// Their length, s.
    pub period_s: f64,
    /// When it began, on CLOCK_MONOTONIC, ns.
    pub begun_ns: u64,
    /// The folder that everything goes to.
    pub out: PathBuf,
    /// What is recorded.
    pub keep: Keep,
    /// Print the summary for machines.
    pub json: bool,
    /// Whether faults were injected.
    pub injected: bool,
    /// Whether an encoder is fitted.
    pub encoder: bool,
}

/// Becomes the supervisor of the mission, with the errand.
///
/// # Errors
/// [`Failure::Failed`] where that program is missing or can't be started.
pub fn hand_over(mission: Mission, errand: &Errand) -> Result<Outcome, Failure> {
    let errand = postcard::to_stdvec(errand).map_err(anyhow::Error::from)?;
    match begin(&Mission { errand, ..mission })? {}
}

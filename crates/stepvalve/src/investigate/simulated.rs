//! A valve that a scenario's truth simulates. Of the truth nothing is looked at but what drive and encoder say.

use super::machine::{Machine, Made};
use crate::diagnose::logs::Clock;
use crate::files::name;
use crate::loaded::load;
use anyhow::{Context, anyhow};
use campaign::record;
use log_data::Log;
use std::path::{Path, PathBuf};
use supervisor::Failure;

/// The scenario of the first experiment, whose limits and models the others keep.
pub struct Simulated {
    scenario: PathBuf,
}

impl Simulated {
    /// Checks the scenario.
    ///
    /// # Errors
    /// [`Failure::Input`] where it has no encoder, or a real drive.
    pub fn new(scenario: &Path) -> Result<Self, Failure> {
        let loaded = load(scenario)?;
        let refuse = |what: &str| Err(Failure::Input(anyhow!("{}: {what}", name(scenario))));
        if loaded.scenario.drive.is_some() {
            return refuse("[drive] is a real one: `stepvalve run` it, and investigate --live");
        }
        if !loaded.scenario.encoder.fitted {
            return refuse("no encoder is fitted, expected one: the command alone says nothing of the valve");
        }
        Ok(Self { scenario: scenario.to_owned() })
    }
}

impl Machine for Simulated {
    fn make(&mut self, number: usize, plan: Option<&Path>, folder: &Path) -> Result<Made, Failure> {
        let file = plan.unwrap_or(&self.scenario);
        let mut loaded = load(file)?;
        // The encoder's noise is another in each run.
        if let Some(encoder) = &mut loaded.parts.plant.encoder {
            encoder.seed = encoder.seed.wrapping_add(number as u64);
        }
        let log = Log { title: loaded.scenario.name.clone(), ..record(&loaded.parts) };
        let path = folder.join(format!("run-{number}.h5"));
        run_log::write_log(&path, &log).with_context(|| name(&path)).map_err(Failure::Failed)?;
        Ok(Made::Logs(vec![path]))
    }

    fn scenario(&self) -> Option<&Path> {
        Some(&self.scenario)
    }
    fn clock(&self) -> Clock {
        Clock::AsWritten
    }
}

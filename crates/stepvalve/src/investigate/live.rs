//! A valve that runs: motions are asked for over its socket, each after the operator has agreed to it.

use super::machine::{Machine, Made};
use crate::files::name;
use crate::live_motion::{Agreed, LiveValve};
use crate::operator::Which;
use anyhow::Context;
use config::{ScheduledSetPoint, parse_scenario};
use std::path::{Path, PathBuf};
use study::experiment::{Range, first_motions};
use supervisor::Failure;

/// A running instance; its scenario, as it was started with, lies in the investigation's folder.
pub struct Live {
    valve: LiveValve,
    scenario: PathBuf,
    within: Vec<Range>,
}

impl Live {
    /// Finds the instance, and writes its scenario and models into the folder.
    ///
    /// # Errors
    /// [`Failure`] where none runs, or its record can't be read.
    pub fn find(which: &Which, folder: &Path, within: &[Range]) -> Result<Self, Failure> {
        let valve = LiveValve::find(which)?;
        std::fs::create_dir_all(folder).with_context(|| name(folder)).map_err(Failure::Failed)?;
        let scenario = valve.write_files(folder)?;
        Ok(Self { valve, scenario, within: within.to_vec() })
    }
}

impl Machine for Live {
    fn make(&mut self, number: usize, plan: Option<&Path>, folder: &Path) -> Result<Made, Failure> {
        let motions: Vec<ScheduledSetPoint> = match plan {
            Some(plan) => {
                let text = crate::files::read(plan)?;
                parse_scenario(&text, &name(plan)).map_err(Failure::input)?.set_points
            }
            None => first_motions(self.valve.scenario(), self.valve.belief(), &self.within),
        };
        let path = folder.join(format!("run-{number}.h5"));
        Ok(match self.valve.make(&motions, &path)? {
            Agreed::Made => Made::Logs(vec![path]),
            Agreed::Declined => Made::Declined,
            Agreed::Interrupted => Made::Interrupted,
        })
    }

    fn scenario(&self) -> Option<&Path> {
        Some(&self.scenario)
    }
}

//! Where experiments are made.

use crate::diagnose::logs::Clock;
use std::path::{Path, PathBuf};
use supervisor::Failure;

/// What came of an experiment.
pub enum Made {
    /// Its logs.
    Logs(Vec<PathBuf>),
    /// The operator did not agree to it.
    Declined,
    /// The operator ended it.
    Interrupted,
}

/// A valve or a rig.
pub trait Machine {
    /// Makes an experiment: the plan's, or the first one, which has none. What it writes is in the folder.
    ///
    /// # Errors
    /// [`Failure`] where it can't be made.
    fn make(&mut self, number: usize, plan: Option<&Path>, folder: &Path) -> Result<Made, Failure>;

    /// The scenario whose limits experiments keep; `None` of a rig, whose log tells them.
    fn scenario(&self) -> Option<&Path>;

    /// What is known of when its experiments were made. One machine makes them one after the other; a simulated valve is new in each.
    fn clock(&self) -> Clock {
        Clock::InOrder
    }
}

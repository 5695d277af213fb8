//! A rig that a command of the user's moves and measures.

use super::machine::{Machine, Made};
use crate::files::name;
use crate::pulse::Pulse;
use anyhow::{Context, anyhow};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use study::experiment::CSV_FILE;
use supervisor::Failure;

/// What was measured first, and the command that measures.
pub struct Measured {
    first: Vec<PathBuf>,
    command: String,
}

impl Measured {
    /// A rig with its first logs.
    pub fn new(first: &[PathBuf], command: &str) -> Self {
        Self { first: first.to_vec(), command: command.to_owned() }
    }
}

impl Machine for Measured {
    fn make(&mut self, number: usize, plan: Option<&Path>, folder: &Path) -> Result<Made, Failure> {
        let Some(plan) = plan else { return Ok(Made::Logs(self.first.clone())) };
        let log = folder.join(format!("run-{number}.h5"));
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let csv = plan.with_file_name(CSV_FILE);
        let pulse = Pulse::new(|| "measuring".to_owned());
        let status = Command::new("sh")
            .arg("-c")
            .arg(&self.command)
            .env("STEPVALVE_PLAN", absolute(plan))
            .env("STEPVALVE_CSV", absolute(&csv))
            .env("STEPVALVE_LOG", absolute(&log))
            .env("STEPVALVE_EXPERIMENT", (number - 1).to_string())
            .stdin(Stdio::inherit())
            .status()
            .with_context(|| format!("--measure {:?}", self.command))
            .map_err(Failure::Failed)?;
        drop(pulse);
        if !status.success() {
            return Err(Failure::Failed(anyhow!("--measure {:?}: {status}", self.command)));
        }
        if !log.is_file() {
            return Err(Failure::Failed(anyhow!(
                "--measure {:?} left no {}, expected a valve-log there ($STEPVALVE_LOG)",
                self.command,
                name(&log)
            )));
        }
        Ok(Made::Logs(vec![log]))
    }

    fn scenario(&self) -> Option<&Path> {
        None
    }
}

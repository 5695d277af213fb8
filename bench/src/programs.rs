//! The real programs, run as a user runs them, in a runtime directory of their own.

use anyhow::{Context, Result, bail};
use processes::ChildSummary;
use realtime::Obtained;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use tempfile::TempDir;

/// What `stepvalve simulate --json` says, as far as it is needed here.
#[derive(Debug, Deserialize)]
pub struct RunSummary {
    /// Cycles of the plant.
    pub cycles: u64,
    /// Length of a cycle, s.
    pub period_s: f64,
    /// Time that the run took without the conversion to run.h5, s.
    pub wall_s: f64,
    /// Messages recorded.
    #[serde(default)]
    pub recorded: u64,
    /// Messages declared missing in the record.
    #[serde(default)]
    pub declared_missing: u64,
    /// The record's flaws.
    #[serde(default)]
    pub record_flaws: Vec<String>,
    /// What each process said.
    pub processes: BTreeMap<String, Process>,
}

/// One process's part of the summary.
#[derive(Debug, Deserialize)]
pub struct Process {
    /// The scheduling really obtained.
    pub scheduling: Option<Obtained>,
    /// What it counted.
    #[serde(flatten)]
    pub counts: ChildSummary,
}

/// The programs of the loop that have deadlines, in the order of their phases.
pub const LOOP: [&str; 3] = ["plant-simulator", "trajectory-generator", "step-controller"];

/// A folder for runs, with a runtime directory; removed with all it holds.
pub struct Workplace {
    folder: TempDir,
}

impl Workplace {
    /// A new folder.
    ///
    /// # Errors
    /// Where the system refuses.
    pub fn new() -> Result<Self> {
        let folder = tempfile::Builder::new().prefix("stepvalve-bench-").tempdir()?;
        std::fs::create_dir(folder.path().join("runtime"))?;
        Ok(Self { folder })
    }

    /// A path in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `stepvalve` with this place's runtime directory.
    ///
    /// # Errors
    /// Where the program is not built.
    pub fn stepvalve(&self) -> Result<Command> {
        Ok(self.in_here(Command::new(beside("stepvalve")?)))
    }

    /// The same, but told to end (SIGTERM) when the thread that started it ends, however that comes.
    ///
    /// # Errors
    /// Where the program is not built.
    pub fn stepvalve_until_we_end(&self) -> Result<Command> {
        let mut command = Command::new("setpriv");
        command.args(["--pdeathsig", "TERM", "--"]).arg(beside("stepvalve")?);
        Ok(self.in_here(command))
    }

    fn in_here(&self, mut command: Command) -> Command {
        command.env("XDG_RUNTIME_DIR", self.path("runtime")).env_remove("RUNTIME_DIRECTORY");
        command.stdin(Stdio::null());
        command
    }

    /// Starts a simulation.
    ///
    /// # Errors
    /// Where the program is not built or can't be started.
    pub fn start_simulate(&self, scenario: &Path, mode: &str, more: &[&str]) -> Result<Run> {
        let mut command = self.stepvalve()?;
        let out = tempfile::Builder::new().prefix("run-").tempdir_in(self.folder.path())?.keep();
        command.args(["simulate", "--json", "--mode", mode, "--out"]).arg(&out).arg(scenario).args(more);
        // Files, not pipes: nobody reads while the run goes, and a summary with histograms is long.
        let (summary, complaints) = (self.path("summary.json"), self.path("complaints"));
        command.stdout(File::create(&summary)?).stderr(File::create(&complaints)?);
        Ok(Run { process: command.spawn().context("stepvalve simulate")?, summary, complaints })
    }

    /// Simulates to the end. A fault that stopped the valve is no failure here: the cycles went on.
    ///
    /// # Errors
    /// Where the run failed; what it complained of is in the error.
    pub fn simulate(&self, scenario: &Path, mode: &str, more: &[&str]) -> Result<RunSummary> {
        self.start_simulate(scenario, mode, more)?.finish()
    }

    /// The newest run's folder.
    pub fn newest_run(&self) -> Option<PathBuf> {
        let entries = std::fs::read_dir(self.folder.path()).ok()?.flatten();
        let runs = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with("run-"));
        runs.max_by_key(|entry| entry.metadata().and_then(|m| m.created()).ok()).map(|entry| entry.path())
    }
}

/// A simulation under way.
pub struct Run {
    /// The supervisor.
    pub process: Child,
    summary: PathBuf,
    complaints: PathBuf,
}

impl Run {
    /// Waits for its end and reads its summary.
    ///
    /// # Errors
    /// Where the run failed.
    pub fn finish(mut self) -> Result<RunSummary> {
        let status = self.process.wait()?;
        if !matches!(status.code(), Some(0 | 3)) {
            let complaints = std::fs::read_to_string(&self.complaints).unwrap_or_default();
            bail!("stepvalve simulate: {status}: {}", complaints.trim());
        }
        serde_json::from_slice(&std::fs::read(&self.summary)?).context("summary of stepvalve simulate")
    }
}

/// A program that cargo built beside this one.
///
/// # Errors
/// Where it is not there.
pub fn beside(name: &str) -> Result<PathBuf> {
    let path = std::env::current_exe()?.with_file_name(name);
    if !path.exists() {
        bail!("{} is missing: cargo build --release --bins", path.display());
    }
    Ok(path)
}

/// Whether a program is on the path.
pub fn installed(name: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(name).is_file())
}

/// The scheduling that the processes with deadlines really had, in words.
pub fn scheduling(summary: &RunSummary) -> String {
    let of = |name: &str| {
        let Some(obtained) = summary.processes.get(name).and_then(|process| process.scheduling.as_ref())
        else {
            return format!("{name}: unknown");
        };
        let policy =
            obtained.priority.map_or("SCHED_OTHER".to_owned(), |priority| format!("SCHED_FIFO {priority}"));
        let core = obtained.core.map_or("any core".to_owned(), |core| format!("core {core}"));
        let memory = if obtained.memory_locked { "memory locked" } else { "memory not locked" };
        format!("{name}: {policy}, {core}, {memory}")
    };
    LOOP.map(of).join("; ")
}

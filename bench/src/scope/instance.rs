//! A running instance, and scopes that look at it.

use crate::programs::Workplace;
use anyhow::{Context, Result, bail};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// How long it may take to start.
const PATIENCE: Duration = Duration::from_secs(20);

/// What the loop's processes counted, together.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub(super) overruns: u64,
    pub(super) skipped: u64,
    pub(super) missed: u64,
}

impl Counts {
    /// What came since.
    pub(super) fn since(self, before: &Self) -> Self {
        Self {
            overruns: self.overruns - before.overruns,
            skipped: self.skipped - before.skipped,
            missed: self.missed - before.missed,
        }
    }
}

/// An instance that turns its valve, recorded into a ring.
pub(super) struct Instance<'a> {
    workplace: &'a Workplace,
    process: Child,
}

impl<'a> Instance<'a> {
    /// Starts it, and waits until it runs.
    ///
    /// # Errors
    /// Where it does not.
    pub(super) fn start(workplace: &'a Workplace) -> Result<Self> {
        let scenario =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../rt-config/scenarios/rotation-200khz.toml");
        let mut command = workplace.stepvalve()?;
        // The ring holds the turns, which come last.
        command.args(["run", "--instance", "bench", "--record", "ring=2GB", "--out"]);
        command.arg(workplace.path("record")).arg(scenario);
        let process = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
        let instance = Self { workplace, process };
        let begun = Instant::now();
        while instance.counts().is_err() {
            if begun.elapsed() > PATIENCE {
                bail!("the instance does not start");
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        instance.order(&["arm"])?;
        instance.order(&["set", "speed", "60rpm"])?;
        Ok(instance)
    }

    fn order(&self, words: &[&str]) -> Result<()> {
        let output = self.workplace.stepvalve()?.args(words).output()?;
        if !output.status.success() {
            bail!("stepvalve {}: {}", words.join(" "), String::from_utf8_lossy(&output.stderr).trim());
        }
        Ok(())
    }

    fn status(&self) -> Result<Value> {
        let output = self.workplace.stepvalve()?.args(["status", "--json"]).output()?;
        serde_json::from_slice(&output.stdout).context("stepvalve status --json")
    }

    /// What its processes counted so far. A valve that was stopped by the machine's stalls is still a loop that is timed.
    ///
    /// # Errors
    /// Where it does not answer.
    pub(super) fn counts(&self) -> Result<Counts> {
        let status = self.status()?;
        let processes =
            status.get("processes").and_then(Value::as_object).context("no processes in the status")?;
        let sum =
            |key: &str| processes.values().filter_map(|process| process.get(key)?.as_u64()).sum::<u64>();
        Ok(Counts {
            overruns: sum("overruns"),
            skipped: sum("skipped_cycles"),
            missed: sum("missed_samples"),
        })
    }

    /// A scope.
    ///
    /// # Errors
    /// Where it does not start.
    pub(super) fn scope(&self, arguments: &[&str]) -> Result<Scope> {
        let mut command = self.workplace.stepvalve()?;
        let mut process = command.args(["scope", "--json"]).args(arguments).stdout(Stdio::piped()).spawn()?;
        let mut line = String::new();
        BufReader::new(process.stdout.take().context("its stdout")?).read_line(&mut line)?;
        let opened: Value = serde_json::from_str(&line).context("stepvalve scope --json")?;
        let page = opened.get("page").and_then(Value::as_str).context("no page's address")?.to_owned();
        Ok(Scope { process, page })
    }

    /// The folder of its record.
    pub(super) fn record(&self) -> PathBuf {
        self.workplace.path("record")
    }

    /// Ends it; how its processes were scheduled, in words.
    ///
    /// # Errors
    /// Where it does not end.
    pub(super) fn end(mut self) -> Result<String> {
        let status = self.status()?;
        let state = status.get("state").and_then(Value::as_str).unwrap_or("unknown");
        kill(pid(&self.process), Signal::SIGTERM)?;
        self.process.wait()?;
        Ok(format!("as rotation-200khz.toml asks for; the valve's state at the end was \"{state}\""))
    }
}

fn pid(process: &Child) -> Pid {
    Pid::from_raw(process.id().cast_signed())
}

/// A scope; it ends when it is dropped.
pub(super) struct Scope {
    process: Child,
    pub(super) page: String,
}

impl Scope {
    pub(super) fn pid(&self) -> u32 {
        self.process.id()
    }

    /// Lets it stand still.
    ///
    /// # Errors
    /// Where it is gone.
    pub(super) fn stop(&self) -> Result<()> {
        Ok(kill(pid(&self.process), Signal::SIGSTOP)?)
    }

    /// Lets it go on.
    ///
    /// # Errors
    /// Where it is gone.
    pub(super) fn go_on(&self) -> Result<()> {
        Ok(kill(pid(&self.process), Signal::SIGCONT)?)
    }
}

impl Drop for Scope {
    fn drop(&mut self) {
        let _ = kill(pid(&self.process), Signal::SIGTERM);
        let _ = self.process.wait();
    }
}

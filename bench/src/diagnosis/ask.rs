//! Asks `stepvalve diagnose`, as a user would.

use crate::programs::beside;
use anyhow::{Context, Result};
use serde_json::{Value, json};
use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// How long things may take, and on how many threads.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// No further campaign is begun after so long.
    pub all: Option<Duration>,
    /// A diagnosis is ended after so long, and counts as one that found nothing.
    pub each: Duration,
    /// Campaigns at a time.
    pub threads: usize,
    /// CRC-32C of the program that is asked.
    pub program: u32,
}

/// What `stepvalve diagnose` says of a log; one that it refuses, or doesn't end with in time, has that for a verdict.
///
/// # Errors
/// Where the program is missing or writes what can't be read.
pub fn diagnose(log: &Path, model: &Path, out: &Path, more: &[String], limit: Duration) -> Result<Value> {
    let said = out.with_extension("said");
    let mut child = Command::new(beside("stepvalve")?)
        .args(["diagnose", "--seed", "0", "--log"])
        .arg(log)
        .arg("--model")
        .arg(model)
        .arg("--out")
        .arg(out)
        .args(more)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(File::create(&said)?)
        .spawn()?;
    let Some(status) = wait(&mut child, limit)? else {
        return Ok(json!({ "verdict": format!("no answer in {} s", limit.as_secs()) }));
    };
    if !status.success() {
        let complaint = std::fs::read_to_string(&said)?;
        let last = complaint.lines().last().unwrap_or_default();
        let why = last.rsplit_once(".h5: ").map_or(last, |(_, why)| why);
        return Ok(json!({ "verdict": format!("refused: {why}") }));
    }
    serde_json::from_slice(&std::fs::read(out.join("diagnosis.json"))?).context("diagnosis.json")
}

/// Waits for a program's end; ends it where that takes longer than `limit`.
fn wait(child: &mut Child, limit: Duration) -> Result<Option<ExitStatus>> {
    let begun = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if begun.elapsed() > limit {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

//! SUNDIALS CVODE as a peer: a small C program, compiled when it is asked for.

use super::laws::Contact;
use super::motions::PERIOD_S;
use super::trace::Trace;
use crate::scenario::repository;
use anyhow::{Context, Result, bail};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

const LIBRARIES: [&str; 5] = [
    "-lsundials_cvode",
    "-lsundials_nvecserial",
    "-lsundials_sunmatrixdense",
    "-lsundials_sunlinsoldense",
    "-lm",
];

/// The compiled peer.
pub struct Peer {
    folder: TempDir,
}

impl Peer {
    /// Compiles it; `None` where SUNDIALS isn't installed.
    ///
    /// # Errors
    /// Where it is, and the compiler refuses all the same.
    pub fn build() -> Result<Option<Self>> {
        if !Path::new("/usr/include/cvode/cvode.h").exists() {
            return Ok(None);
        }
        let peer = Self { folder: tempfile::tempdir()? };
        let mut compiler = Command::new(std::env::var_os("CC").unwrap_or_else(|| "cc".into()));
        compiler.args(["-O3", "-Wall", "-Wextra", "-o"]).arg(peer.program());
        compiler.arg(repository().join("bench/peers/cvode_valve.c")).args(LIBRARIES);
        let output = compiler.output().context("the C compiler")?;
        if !output.status.success() {
            bail!("bench/peers/cvode_valve.c: {}", String::from_utf8_lossy(&output.stderr));
        }
        Ok(Some(peer))
    }

    fn program(&self) -> std::path::PathBuf {
        self.folder.path().join("cvode_valve")
    }

    /// Integrates the commands with a relative tolerance.
    ///
    /// # Errors
    /// Where CVODE gives up.
    pub fn run(&self, rtol: &str, contact: &Contact, commands: &[f64]) -> Result<Trace> {
        let cycles = commands.len().saturating_sub(1);
        let mut command = Command::new(self.program());
        command.args([rtol, &cycles.to_string(), &PERIOD_S.to_string()]).args(contact.arguments());
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().context("cvode_valve")?;
        let text: String = commands.iter().map(|command| format!("{command:e}\n")).collect();
        child.stdin.take().context("stdin")?.write_all(text.as_bytes())?;
        let output = child.wait_with_output()?;
        let complaints = String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            bail!("cvode_valve at {rtol}: {complaints}");
        }
        let us = complaints.split_whitespace().last().context("cvode_valve's cost")?;
        let mut trace = Trace { us_per_cycle: us.parse()?, ..Trace::default() };
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            let fields = line.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
            let [angle, _, torque] = fields[..] else { bail!("cvode_valve wrote {line}") };
            trace.angles_rad.push(angle);
            trace.torques_nm.push(torque);
        }
        Ok(trace)
    }
}

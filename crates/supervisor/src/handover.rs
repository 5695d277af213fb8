//! From the command line to the supervisor and back: one process that becomes another program, and keeps its id.
//!
//! `stepvalve` reads files and writes pages, so it links HDF5 and much else. While the valve moves, its process is
//! `stepvalve-supervisor`, which links none of that. The id stays, and with it what a terminal, systemd or a script knows
//! of the process. What is handed over is a frame in a memory file that the next program has as its stdin.

use crate::mission::{Conclusion, Mission};
use anyhow::{Context, Result};
use processes::{read_frame, write_frame};
use rustix::fs::{MemfdFlags, memfd_create};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::convert::Infallible;
use std::fs::File;
use std::io::Seek;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;

/// The program that supervises.
const SUPERVISOR: &str = "stepvalve-supervisor";
/// The command line.
const COMMAND_LINE: &str = "stepvalve";
/// Its subcommand that takes over again.
pub const CONCLUDE: &str = "conclude";

/// Becomes the supervisor of a mission. Returns only where that fails.
///
/// # Errors
/// Where the program is missing beside this one, or can't be started.
pub fn begin(mission: &Mission) -> Result<Infallible> {
    become_program(SUPERVISOR, &[], mission)
}

/// Becomes the command line again, which tells the user how it ended. Returns only where that fails.
///
/// # Errors
/// As [`begin`].
pub fn conclude(conclusion: &Conclusion) -> Result<Infallible> {
    become_program(COMMAND_LINE, &[CONCLUDE], conclusion)
}

/// What the program before handed over.
///
/// # Errors
/// Where stdin holds something else.
pub fn received<T: DeserializeOwned>() -> Result<T> {
    let handed_over = read_frame(std::io::stdin()).context("what was handed over on stdin")?;
    handed_over.context("nothing was handed over on stdin: this program is started by stepvalve, not by hand")
}

/// A program that lies beside this one.
///
/// # Errors
/// Where it does not.
pub(crate) fn beside(name: &str) -> Result<PathBuf> {
    let path = std::env::current_exe().context("path of this program")?.with_file_name(name);
    path.exists().then_some(()).with_context(|| format!("{} is missing beside stepvalve", path.display()))?;
    Ok(path)
}

fn become_program(name: &str, arguments: &[&str], content: &impl Serialize) -> Result<Infallible> {
    let path = beside(name)?;
    let mut file = File::from(memfd_create("stepvalve-handover", MemfdFlags::CLOEXEC)?);
    write_frame(&mut file, content).context("handing over")?;
    file.rewind()?;
    // The new program's stdin is a copy of the descriptor: the original closes by itself.
    Err(Command::new(&path).args(arguments).stdin(file).exec()).with_context(|| path.display().to_string())
}

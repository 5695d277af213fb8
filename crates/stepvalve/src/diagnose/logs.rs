//! The logs of a diagnosis: one, or several as one.

use crate::files::{name, run_file};
use crate::strangers;
use anyhow::anyhow;
use log_data::{AngleZero, Log};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use supervisor::Failure;

/// Reads logs, leaves out runs, and rows in which the motor carried no current.
///
/// Runs of several logs are called LOG:RUN, where LOG is the file's name without its end. Their clock is taken for one where
/// no two runs overlap; else each has its own, and neither their order nor the rests between them are known.
///
/// # Errors
/// [`Failure::Input`] where a log can't be read, two have one name, or a run to be left out isn't there.
pub fn read(files: &[PathBuf], exclude: &[String]) -> Result<Log, Failure> {
    let mut all: Option<Log> = None;
    let mut stems: Vec<String> = Vec::new();
    for file in files {
        let mut log = strangers::log(&run_file(file)?)?;
        if files.len() > 1 {
            let stem = stem(file);
            if stems.contains(&stem) {
                return Err(Failure::Input(anyhow!(
                    "{}: another log is called {stem}, too; expected different names, which their runs are told apart by",
                    name(file)
                )));
            }
            log.runs.iter_mut().for_each(|run| run.name = format!("{stem}:{}", run.name));
            stems.push(stem);
        }
        match &mut all {
            None => all = Some(log),
            Some(all) => join(all, log),
        }
    }
    let mut log = all.unwrap_or_default();
    study::prepare(&mut log, exclude).map_err(Failure::Input)?;
    Ok(log)
}

fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or(OsStr::new("log")).to_string_lossy().into_owned()
}

fn join(all: &mut Log, log: Log) {
    all.title = format!("{} + {}", all.title, log.title);
    if log.angle_zero == AngleZero::PerRun {
        all.angle_zero = AngleZero::PerRun;
    }
    all.runs.extend(log.runs);
}

//! The logs of a diagnosis: one, or several as one.

use crate::files::{name, run_file};
use crate::strangers;
use anyhow::anyhow;
use log_data::{AngleZero, Log, Run};
use processes::complain;
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
    read_on(Clock::AsWritten, files, exclude)
}

/// What is known of when several logs were made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Clock {
    /// What their times say.
    #[default]
    AsWritten,
    /// One after the other, as they are given: one whose times say otherwise is put behind those before it.
    InOrder,
}

/// The same, on this clock.
///
/// # Errors
/// As [`read`].
pub fn read_on(clock: Clock, files: &[PathBuf], exclude: &[String]) -> Result<Log, Failure> {
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
            Some(all) => {
                if clock == Clock::InOrder && put_behind(all, &mut log) {
                    complain(format_args!(
                        "note: {} has a clock of its own: it is put {PAUSE_S} s behind the logs before it",
                        name(file)
                    ));
                }
                join(all, log);
            }
        }
    }
    let mut log = all.unwrap_or_default();
    study::prepare(&mut log, exclude).map_err(Failure::Input)?;
    Ok(log)
}

fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or(OsStr::new("log")).to_string_lossy().into_owned()
}

/// Between two logs of which only the order is known, s.
const PAUSE_S: f64 = 60.0;

/// Moves a log behind all of those before it, where it does not begin there; whether it had to be.
fn put_behind(all: &Log, log: &mut Log) -> bool {
    let end_s = all.runs.iter().map(Run::end_s).fold(f64::NEG_INFINITY, f64::max);
    let start_s = log.runs.iter().map(Run::start_s).fold(f64::INFINITY, f64::min);
    let is_behind = start_s > end_s;
    if !is_behind {
        log.runs.iter_mut().for_each(|run| run.shift(end_s + PAUSE_S - start_s));
    }
    !is_behind
}

fn join(all: &mut Log, log: Log) {
    all.title = format!("{} + {}", all.title, log.title);
    if log.angle_zero == AngleZero::PerRun {
        all.angle_zero = AngleZero::PerRun;
    }
    all.runs.extend(log.runs);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_on_a_clock_of_its_own_is_put_behind() {
        let log = |start_s: f64| {
            let run = Run { time_s: vec![start_s, start_s + 1.0], angle_rad: vec![0.0; 2], ..Run::default() };
            Log { runs: vec![run], ..Log::default() }
        };
        for (start_s, moved, expected_s) in [(0.0, true, 71.0), (10.5, true, 71.0), (12.0, false, 12.0)] {
            let mut second = log(start_s);
            assert_eq!(put_behind(&log(10.0), &mut second), moved, "{start_s}");
            assert_eq!(second.runs[0].time_s, [expected_s, expected_s + 1.0], "{start_s}");
        }
    }
}

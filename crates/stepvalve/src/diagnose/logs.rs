//! The logs of a diagnosis: one, or several as one.

use crate::files::name;
use crate::strangers;
use anyhow::anyhow;
use log_data::{AngleZero, Channel, Log, Run};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use supervisor::Failure;
use valve_model::Model;

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
        let mut log = strangers::log(file)?;
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
    leave_out(&mut log, exclude).map_err(Failure::Input)?;
    for run in &mut log.runs {
        log_data::cut_to_energised(run);
        run.extra = Vec::new();
    }
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

/// Cuts runs in which too many samples are missing to what is known of them, and leaves out those of which nothing is; what was
/// done, in words.
///
/// # Errors
/// Where nothing is left.
pub fn cut_to_known(log: &mut Log, model: &Model) -> anyhow::Result<Vec<String>> {
    let commanded = model.motor.is_some() && log.runs.iter().all(|run| run.angle_command_rad.is_some());
    let needed = [Channel::Angle, if commanded { Channel::AngleCommand } else { Channel::Torque }];
    let useful = [Channel::PressureDrop, Channel::OilTemperature];
    let mut told: Vec<String> =
        log.runs.iter_mut().flat_map(|run| log_data::cut_to_known(run, &needed, &useful)).collect();
    log.runs.retain(|run| !run.is_empty());
    told.extend(useful.into_iter().filter_map(|channel| agree(log, channel)));
    match (log.runs.is_empty(), told.first()) {
        (true, Some(first)) => {
            Err(anyhow!("no run is left: {first}, expected four fifths of them in one run at least"))
        }
        _ => Ok(told),
    }
}

/// Makes all runs have a channel, or none: what depends on it can't be computed for a run without it. Leaves out the runs
/// without it where they hold half of the samples at most; else does without the channel.
fn agree(log: &mut Log, channel: Channel) -> Option<String> {
    let samples: usize = log.runs.iter().map(Run::len).sum();
    let without: Vec<&Run> = log.runs.iter().filter(|run| run.channel(channel).is_none()).collect();
    let lacking: usize = without.iter().map(|run| run.len()).sum();
    if lacking == 0 || without.len() == log.runs.len() {
        return None;
    }
    let names = without.iter().map(|run| run.name.as_str()).collect::<Vec<_>>().join(", ");
    let (runs, of) = (without.len(), log.runs.len());
    if 2 * lacking > samples {
        log.runs.iter_mut().for_each(|run| drop(run.take_channel(channel)));
        return Some(format!(
            "{channel} is not used: {runs} of {of} runs have none ({names}); --exclude leaves them out instead"
        ));
    }
    log.runs.retain(|run| run.channel(channel).is_some());
    Some(format!("{runs} of {of} runs are left out, since they have no {channel}: {names}"))
}

fn leave_out(log: &mut Log, exclude: &[String]) -> anyhow::Result<()> {
    if let Some(unknown) = exclude.iter().find(|wanted| log.run(wanted).is_none()) {
        let names: Vec<&str> = log.runs.iter().map(|run| run.name.as_str()).collect();
        return Err(anyhow!("--exclude: found no run {unknown}, expected one of {}", names.join(", ")));
    }
    log.runs.retain(|run| !exclude.contains(&run.name));
    if log.runs.is_empty() {
        return Err(anyhow!("--exclude: no run is left, expected one at least"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs of these lengths, those marked with a pressure.
    fn log(runs: &[(usize, bool)]) -> Log {
        let run = |(index, (rows, pressure)): (usize, &(usize, bool))| Run {
            name: index.to_string(),
            time_s: vec![0.0; *rows],
            pressure_drop_pa: pressure.then(|| vec![0.0; *rows]),
            ..Run::default()
        };
        Log { runs: runs.iter().enumerate().map(run).collect(), ..Log::default() }
    }

    #[test]
    fn runs_without_a_channel_of_the_others() {
        type Case<'a> = (&'a [(usize, bool)], usize, usize, bool);
        let table: [Case; 5] = [
            (&[(10, true), (10, true)], 2, 2, false),
            (&[(10, false), (10, false)], 2, 0, false),
            (&[(10, true), (10, false)], 1, 1, true),
            (&[(10, true), (11, false)], 2, 0, true),
            (&[(20, true), (5, false), (5, false), (5, true)], 2, 2, true),
        ];
        for (runs, left, with, told) in table {
            let mut log = log(runs);
            assert_eq!(agree(&mut log, Channel::PressureDrop).is_some(), told, "{runs:?}");
            let having = log.runs.iter().filter(|run| run.pressure_drop_pa.is_some()).count();
            assert_eq!((log.runs.len(), having), (left, with), "{runs:?}");
        }
    }
}

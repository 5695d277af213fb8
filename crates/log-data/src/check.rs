//! What every log must fulfil before anything is computed from it.

use crate::{Channel, Log, Run};
use std::collections::BTreeSet;
use thiserror::Error;

/// What is wrong with a log. Rows count from 1.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LogError {
    /// There is nothing in it.
    #[error("the log has no runs, expected at least one")]
    NoRuns,
    /// Two runs, or two signals of one, can't be told apart.
    #[error("{place}: the name {name:?} occurs twice, expected each once")]
    DuplicateName {
        /// The run, or "log".
        place: String,
        /// The name.
        name: String,
    },
    /// A name that no file can hold.
    #[error("{place}: the name {name:?} is empty, \".\", \"..\", or holds a slash or a control character")]
    BadName {
        /// The run, or "log".
        place: String,
        /// The name.
        name: String,
    },
    /// A signal has another length than time.
    #[error("run {run}: {channel} has {found} samples, expected {expected} as time has")]
    Length {
        /// The run.
        run: String,
        /// The signal.
        channel: String,
        /// Its length.
        found: usize,
        /// The length of time.
        expected: usize,
    },
    /// A required channel holds no number at all.
    #[error("run {run}: {channel} has no valid sample, expected at least one")]
    NoSamples {
        /// The run.
        run: String,
        /// The channel.
        channel: Channel,
    },
    /// Time is missing or infinite.
    #[error("run {run}, row {row}: time is {found}, expected a finite number")]
    TimeNotFinite {
        /// The run.
        run: String,
        /// The row.
        row: usize,
        /// The time there.
        found: f64,
    },
    /// Time stands still or goes back.
    #[error("run {run}, row {row}: time is {found} s after {previous} s, expected it to increase")]
    TimeNotIncreasing {
        /// The run.
        run: String,
        /// The row.
        row: usize,
        /// The time there.
        found: f64,
        /// The time in the row before.
        previous: f64,
    },
    /// A sample is infinite. A missing one is NaN.
    #[error("run {run}, row {row} (time {time_s} s): {channel} is {found}, expected a finite number or NaN")]
    Infinite {
        /// The run.
        run: String,
        /// The row.
        row: usize,
        /// The time there.
        time_s: f64,
        /// The signal.
        channel: String,
        /// Its value there.
        found: f64,
    },
}

impl Log {
    /// Checks names, lengths, times and samples of all runs.
    ///
    /// # Errors
    /// The first [`LogError`] found.
    pub fn check(&self) -> Result<(), LogError> {
        if self.runs.is_empty() {
            return Err(LogError::NoRuns);
        }
        check_names("log", self.runs.iter().map(|run| run.name.as_str()))?;
        self.runs.iter().try_for_each(Run::check)
    }
}

impl Run {
    /// Checks the run alone.
    ///
    /// # Errors
    /// The first [`LogError`] found.
    pub fn check(&self) -> Result<(), LogError> {
        let known = Channel::ALL.iter().map(|channel| channel.name());
        let names = known.chain(self.extra.iter().map(|extra| extra.name.as_str()));
        check_names(&format!("run {}", self.name), names)?;
        self.check_times()?;
        for channel in Channel::ALL {
            if let Some(values) = self.channel(*channel) {
                self.check_values(channel.name(), values)?;
            }
        }
        self.extra.iter().try_for_each(|extra| self.check_values(&extra.name, &extra.values))?;
        let angle_is_there = self.angle_rad.iter().any(|angle| angle.is_finite());
        let missing = || LogError::NoSamples { run: self.name.clone(), channel: Channel::Angle };
        angle_is_there.then_some(()).ok_or_else(missing)
    }

    fn check_times(&self) -> Result<(), LogError> {
        let run = || self.name.clone();
        let mut previous = f64::NEG_INFINITY;
        for (row, &found) in (1..).zip(&self.time_s) {
            if !found.is_finite() {
                return Err(LogError::TimeNotFinite { run: run(), row, found });
            }
            if found <= previous {
                return Err(LogError::TimeNotIncreasing { run: run(), row, found, previous });
            }
            previous = found;
        }
        if self.is_empty() {
            return Err(LogError::NoSamples { run: run(), channel: Channel::Time });
        }
        Ok(())
    }

    fn check_values(&self, channel: &str, values: &[f64]) -> Result<(), LogError> {
        let (run, channel) = (|| self.name.clone(), || channel.to_owned());
        let (found, expected) = (values.len(), self.len());
        if found != expected {
            return Err(LogError::Length { run: run(), channel: channel(), found, expected });
        }
        let mut rows = (1..).zip(self.time_s.iter().zip(values));
        match rows.find(|(_, (_, value))| value.is_infinite()) {
            Some((row, (&time_s, &found))) => {
                Err(LogError::Infinite { run: run(), row, time_s, channel: channel(), found })
            }
            None => Ok(()),
        }
    }
}

fn check_names<'a>(place: &str, names: impl Iterator<Item = &'a str>) -> Result<(), LogError> {
    let mut seen = BTreeSet::new();
    for name in names {
        let place = || place.to_owned();
        if matches!(name, "" | "." | "..") || name.contains(|c: char| c == '/' || c.is_control()) {
            return Err(LogError::BadName { place: place(), name: name.to_owned() });
        }
        if !seen.insert(name) {
            return Err(LogError::DuplicateName { place: place(), name: name.to_owned() });
        }
    }
    Ok(())
}

//! Logs and their runs.

use crate::Channel;
use std::collections::BTreeMap;
use std::ops::Range;

/// Whether the angles of different runs share their zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AngleZero {
    /// One zero for the whole log.
    #[default]
    Common,
    /// Each run has a zero of its own.
    PerRun,
}

impl AngleZero {
    /// How files write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Common => "common",
            Self::PerRun => "per-run",
        }
    }

    /// From what files write.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Common, Self::PerRun].into_iter().find(|zero| zero.name() == name)
    }
}

/// A fact about a run or a log, beside its samples.
#[derive(Debug, Clone, PartialEq)]
pub enum Attribute {
    /// Words.
    Text(String),
    /// A number; its name should end in the unit.
    Number(f64),
}

/// A signal that models do not know.
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    /// Its name.
    pub name: String,
    /// Its unit; "1" for a number without one.
    pub unit: String,
    /// One value for each sample of the run, NaN where missing.
    pub values: Vec<f64>,
}

/// Measured runs on one clock.
///
/// ```
/// use log_data::{Channel, Log, Run};
///
/// let run = Run {
///     name: "slow".to_owned(),
///     kind: "constant-velocity".to_owned(),
///     time_s: vec![0.0, 0.001, 0.002],
///     angle_rad: vec![0.0, 0.0005, 0.001],
///     torque_nm: Some(vec![1.51, 1.49, 1.50]),
///     ..Run::default()
/// };
/// let log = Log { runs: vec![run], ..Log::default() };
/// assert!(log.check().is_ok());
/// assert_eq!(log.run("slow").and_then(|run| run.channel(Channel::Torque)).map(<[f64]>::len), Some(3));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Log {
    /// What it is, in a line.
    pub title: String,
    /// Where it comes from.
    pub provenance: Option<String>,
    /// Whether runs share the angle's zero.
    pub angle_zero: AngleZero,
    /// Further facts.
    pub attributes: BTreeMap<String, Attribute>,
    /// The runs, in any order; their times tell which came first.
    pub runs: Vec<Run>,
}

/// One run: samples of all its channels at the same times.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Run {
    /// Its name, unique in the log.
    pub name: String,
    /// What was done: constant-velocity, sine, closed-loop, ...; free text.
    pub kind: String,
    /// Further facts.
    pub attributes: BTreeMap<String, Attribute>,
    /// Time of each sample on the log's clock; strictly increasing.
    pub time_s: Vec<f64>,
    /// Measured valve angle.
    pub angle_rad: Vec<f64>,
    /// Commanded angle; linear between samples.
    pub angle_command_rad: Option<Vec<f64>>,
    /// What a transducer between motor and load reads: J_load·ω̇ + friction + whatever else loads the spool.
    pub torque_nm: Option<Vec<f64>>,
    /// Pressure drop over the orifice.
    pub pressure_drop_pa: Option<Vec<f64>>,
    /// Flow through the orifice.
    pub flow_m3_per_s: Option<Vec<f64>>,
    /// Oil temperature.
    pub oil_temperature_c: Option<Vec<f64>>,
    /// Signals that models do not know.
    pub extra: Vec<Extra>,
}

impl Log {
    /// The run of this name.
    pub fn run(&self, name: &str) -> Option<&Run> {
        self.runs.iter().find(|run| run.name == name)
    }

    /// The runs in the order in which they were made.
    pub fn runs_in_time(&self) -> Vec<&Run> {
        let mut runs: Vec<_> = self.runs.iter().collect();
        runs.sort_by(|a, b| a.start_s().total_cmp(&b.start_s()));
        runs
    }

    /// Whether no two runs overlap in time, as it must be with one clock and one valve. Where they do, each run
    /// was given a clock of its own, and neither their order nor the rests between them are known.
    pub fn is_on_one_clock(&self) -> bool {
        self.runs_in_time().windows(2).all(|pair| match pair {
            [earlier, later] => earlier.end_s() <= later.start_s(),
            _ => true,
        })
    }
}

impl Run {
    /// The number of samples.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Time of the first sample; NaN without samples.
    pub fn start_s(&self) -> f64 {
        self.time_s.first().copied().unwrap_or(f64::NAN)
    }

    /// Time of the last sample; NaN without samples.
    pub fn end_s(&self) -> f64 {
        self.time_s.last().copied().unwrap_or(f64::NAN)
    }

    /// Moves all of it on its log's clock.
    pub fn shift(&mut self, by_s: f64) {
        self.time_s.iter_mut().for_each(|time_s| *time_s += by_s);
    }

    /// A channel's samples, in its unit; `None` where the run does not have it.
    pub fn channel(&self, channel: Channel) -> Option<&[f64]> {
        match channel {
            Channel::Time => Some(&self.time_s),
            Channel::Angle => Some(&self.angle_rad),
            Channel::AngleCommand => self.angle_command_rad.as_deref(),
            Channel::Torque => self.torque_nm.as_deref(),
            Channel::PressureDrop => self.pressure_drop_pa.as_deref(),
            Channel::Flow => self.flow_m3_per_s.as_deref(),
            Channel::OilTemperature => self.oil_temperature_c.as_deref(),
        }
    }

    /// Takes a channel's samples out of the run; `None` where it does not have it.
    pub fn take_channel(&mut self, channel: Channel) -> Option<Vec<f64>> {
        match channel {
            Channel::Time => Some(std::mem::take(&mut self.time_s)),
            Channel::Angle => Some(std::mem::take(&mut self.angle_rad)),
            Channel::AngleCommand => self.angle_command_rad.take(),
            Channel::Torque => self.torque_nm.take(),
            Channel::PressureDrop => self.pressure_drop_pa.take(),
            Channel::Flow => self.flow_m3_per_s.take(),
            Channel::OilTemperature => self.oil_temperature_c.take(),
        }
    }

    /// Sets a channel's samples, in its unit.
    pub fn set_channel(&mut self, channel: Channel, values: Vec<f64>) {
        match channel {
            Channel::Time => self.time_s = values,
            Channel::Angle => self.angle_rad = values,
            Channel::AngleCommand => self.angle_command_rad = Some(values),
            Channel::Torque => self.torque_nm = Some(values),
            Channel::PressureDrop => self.pressure_drop_pa = Some(values),
            Channel::Flow => self.flow_m3_per_s = Some(values),
            Channel::OilTemperature => self.oil_temperature_c = Some(values),
        }
    }

    /// Cuts all channels to these rows.
    pub fn keep_rows(&mut self, rows: Range<usize>) {
        let cut = |values: &[f64]| values.get(rows.clone()).unwrap_or_default().to_vec();
        for channel in Channel::ALL.iter().copied() {
            if let Some(values) = self.take_channel(channel) {
                self.set_channel(channel, cut(&values));
            }
        }
        self.extra.iter_mut().for_each(|extra| extra.values = cut(&extra.values));
    }

    /// A signal that models do not know, by name.
    pub fn extra(&self, name: &str) -> Option<&Extra> {
        self.extra.iter().find(|extra| extra.name == name)
    }
}

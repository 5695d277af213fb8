//! What is found, where, what speaks for it, and how it is mended.

use log_data::Channel;
use serde::Serialize;

/// What is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Torque acts with the motion instead of against it: the torque, or the angle, has the wrong sign.
    TorqueSign,
    /// The angle runs against its command.
    AngleDirection,
    /// Angles in degrees.
    AngleUnit,
    /// A torque in N·cm, mN·m and the like.
    TorqueUnit,
    /// Times in ms or µs.
    TimeUnit,
    /// A pressure in bar or MPa.
    PressureUnit,
    /// Two channels hold each other's samples.
    SwappedChannels,
    /// The torque has nothing to do with the motion that the angle says.
    WrongAngle,
    /// Some runs are in other units, or have another sign, than the others.
    RunsDiffer,
    /// A channel ends at a rail.
    Clipped,
    /// Rows are missing.
    Gaps,
    /// The interval between samples varies.
    UnevenSampling,
    /// Samples are repeated: the record is faster than what it records.
    DoubledSamples,
    /// A channel that never changes.
    ConstantChannel,
    /// Single samples far from their neighbours.
    Outliers,
    /// Samples are missing (NaN).
    MissingSamples,
    /// A channel that some runs lack.
    MissingChannel,
    /// The torque's zero moves with time.
    ZeroDrift,
    /// The transducer is slower than its record.
    Bandwidth,
    /// Runs that are too short to be checked.
    TooShort,
    /// No channel that a model predicts.
    NothingToPredict,
}

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// Results from this log would be wrong: mend it first.
    Mistake,
    /// A property of the record that results depend on.
    Note,
}

/// Where something was found.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Place {
    /// The runs; all of the log where there is none.
    pub runs: Vec<String>,
    /// The channels.
    pub channels: Vec<&'static str>,
    /// First and last row, from 1, of the first such place in the first run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows: Option<(usize, usize)>,
}

/// One thing that is wrong, or that one must know.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// What.
    pub kind: Kind,
    /// How much it matters.
    pub severity: Severity,
    /// Where.
    pub place: Place,
    /// What was found, and what speaks for it: a sentence.
    pub evidence: String,
    /// What to do about it: a sentence.
    pub mend: String,
}

impl Place {
    /// A channel, in these runs.
    pub(crate) fn of(channels: &[Channel], runs: Vec<String>) -> Self {
        Self { runs, channels: channels.iter().map(|channel| channel.name()).collect(), rows: None }
    }

    /// The same with rows.
    pub(crate) fn rows(self, first: usize, last: usize) -> Self {
        Self { rows: Some((first, last)), ..self }
    }
}

impl Kind {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::TorqueSign => "torque-sign",
            Self::AngleDirection => "angle-direction",
            Self::AngleUnit => "angle-unit",
            Self::TorqueUnit => "torque-unit",
            Self::TimeUnit => "time-unit",
            Self::PressureUnit => "pressure-unit",
            Self::SwappedChannels => "swapped-channels",
            Self::WrongAngle => "wrong-angle",
            Self::RunsDiffer => "runs-differ",
            Self::Clipped => "clipped",
            Self::Gaps => "gaps",
            Self::UnevenSampling => "uneven-sampling",
            Self::DoubledSamples => "doubled-samples",
            Self::ConstantChannel => "constant-channel",
            Self::Outliers => "outliers",
            Self::MissingSamples => "missing-samples",
            Self::MissingChannel => "missing-channel",
            Self::ZeroDrift => "zero-drift",
            Self::Bandwidth => "bandwidth",
            Self::TooShort => "too-short",
            Self::NothingToPredict => "nothing-to-predict",
        }
    }
}

/// Runs in words: a few by name, else how many.
pub(crate) fn in_runs(runs: &[String], all: usize) -> String {
    match runs {
        [] => "in all runs".to_owned(),
        many if many.len() == all && all > 1 => format!("in all {all} runs"),
        [one] => format!("in run {one}"),
        few if few.len() <= 3 => format!("in runs {}", few.join(", ")),
        many => format!("in {} of {all} runs ({}, ...)", many.len(), many.first().map_or("", String::as_str)),
    }
}

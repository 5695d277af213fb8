//! How tables are read and what is made of them: what the command line and recipes say alike.

use anyhow::{anyhow, ensure};
use serde::{Deserialize, Serialize};
use std::num::NonZero;
use table_import::{Condition, Format, Header, Interleaved, Map, Rows, Selection, Separator, Skip};

/// What can be said in a recipe too. The keys are the options' names, with _ for -.
#[derive(Debug, Clone, Default, clap::Args, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Mapping {
    /// `stepvalve-recipe`, and 1: what every recipe begins with.
    #[arg(skip)]
    pub format: Option<String>,
    #[arg(skip)]
    pub format_version: Option<i64>,
    /// What the log is, in a line
    #[arg(long)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// What was done: constant-velocity, sine, ...; one for all files, or one for each
    #[arg(long = "kind", value_name = "KIND")]
    #[serde(rename = "kind", skip_serializing_if = "Vec::is_empty")]
    pub kinds: Vec<String>,
    /// Whether the runs share the angle's zero; common without
    #[arg(long, value_enum)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_zero: Option<Zero>,
    /// Put the runs on one clock: each begins so many seconds after the one before it ended. Files in a shell's order (run-1,
    /// run-10, run-2) follow one another by their numbers, others as they are given
    #[arg(long, value_name = "SECONDS")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap: Option<f64>,
    /// Only these rows of each file, counted from 1: 1..5000, 5001..
    #[arg(long, value_name = "FIRST..LAST")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows: Option<Rows>,
    /// Only every Nth row
    #[arg(long, value_name = "N")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every: Option<NonZero<usize>>,
    /// Only rows in which this holds: 'c5>0 && abs(speed)<2'; may be given several times
    #[arg(long = "where", value_name = "CONDITION")]
    #[serde(rename = "where", with = "conditions", skip_serializing_if = "Vec::is_empty")]
    pub conditions: Vec<Condition>,
    /// A low-pass on every channel (without delay), then every Nth row
    #[arg(long, value_name = "N")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decimate: Option<NonZero<usize>>,
    /// So many lines before the names; auto: all before the first rows of numbers, and the one or two lines straight above
    /// them, as long as they are, are names and units
    #[arg(long, value_name = "LINES|auto")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skip: Option<Skip>,
    /// A line of units follows the names. A column that is mapped as it is, and in another unit, is refused
    #[arg(long)]
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub units_line: bool,
    /// What stands between the numbers of a line: tabs, else semicolons, else commas, else spaces without
    #[arg(long, value_enum)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separator: Option<Separator>,
    /// Whether the first line holds names: where it isn't all numbers without
    #[arg(long, value_enum)]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub header: Option<Header>,
    /// 1,5 is one and a half
    #[arg(long)]
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub decimal_comma: bool,
    /// A sample of this value is missing, as one is of which nothing, nan, na, null or - is said
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true)]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// How dates and times of day are written, as strptime has it: '%d.%m.%Y %H:%M:%S%.f'. ISO 8601 is read without, to
    /// seconds since 1970; a time of day to seconds since midnight
    #[arg(long, value_name = "FORMAT")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_format: Option<String>,
    /// Each line is one sample: the columns of its name, its time and its value. Every name becomes a column, and `time` one
    #[arg(long, value_name = "NAME,TIME,VALUE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interleaved: Option<Interleaved>,
    /// What a channel is made of: time='t*0.001', angle='c5/12.5', `'motor_current[A]'=i_q`. Columns by their names, or c1
    /// to cN, or {any name}; row counts from 0. Channels: time s, angle rad, angle_command rad, torque N*m,
    /// pressure_drop Pa, flow m^3/s, oil_temperature degC; others need their unit in brackets. --help lists functions
    #[arg(long = "map", value_name = "CHANNEL=EXPRESSION")]
    #[serde(with = "maps")]
    pub map: Vec<Map>,
}

/// Whose the angle's zero is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Zero {
    Common,
    PerRun,
}

impl Mapping {
    /// This, and what another says where this says nothing. A channel that both map is mapped as here.
    pub(super) fn or(self, other: Self) -> Self {
        let mapped = |map: &Map| self.map.iter().any(|known| known.target() == map.target());
        let map = other.map.into_iter().filter(|map| !mapped(map)).collect::<Vec<_>>();
        Self {
            format: None,
            format_version: None,
            title: self.title.or(other.title),
            kinds: either(self.kinds, other.kinds),
            angle_zero: self.angle_zero.or(other.angle_zero),
            gap: self.gap.or(other.gap),
            rows: self.rows.or(other.rows),
            every: self.every.or(other.every),
            conditions: either(self.conditions, other.conditions),
            decimate: self.decimate.or(other.decimate),
            skip: self.skip.or(other.skip),
            units_line: self.units_line || other.units_line,
            separator: self.separator.or(other.separator),
            header: self.header.or(other.header),
            decimal_comma: self.decimal_comma || other.decimal_comma,
            missing: either(self.missing, other.missing),
            time_format: self.time_format.or(other.time_format),
            interleaved: self.interleaved.or(other.interleaved),
            map: map.into_iter().chain(self.map).collect(),
        }
    }

    /// Checks what can be checked without a file.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        for needed in ["time", "angle"] {
            ensure!(
                self.map.iter().any(|map| map.target() == needed),
                "no --map {needed}=..., expected one: every run has it"
            );
        }
        for (index, map) in self.map.iter().enumerate() {
            let twice = self.map.iter().skip(index + 1).any(|other| other.target() == map.target());
            ensure!(!twice, "--map {}: given twice, expected once", map.target());
        }
        if let Some(gap_s) = self.gap {
            ensure!(gap_s.is_finite() && gap_s > 0.0, "--gap {gap_s}: expected a time above zero, s");
        }
        self.format().check().map_err(|error| anyhow!("--time-format: {error}"))
    }

    /// How a text is read.
    pub(super) fn format(&self) -> Format {
        Format {
            separator: self.separator.unwrap_or_default(),
            header: self.header.unwrap_or_default(),
            skip: self.skip.unwrap_or_default(),
            units_line: self.units_line,
            decimal_comma: self.decimal_comma,
            missing: self.missing.clone(),
            time_format: self.time_format.clone(),
        }
    }

    /// Which rows are taken, `numbers` at most.
    pub(super) fn selection(&self, numbers: usize) -> Selection {
        Selection {
            rows: self.rows,
            conditions: self.conditions.clone(),
            every: self.every,
            decimate: self.decimate,
            numbers,
        }
    }
}

fn either<T>(one: Vec<T>, other: Vec<T>) -> Vec<T> {
    if one.is_empty() { other } else { one }
}

/// Conditions as a list of texts.
mod conditions {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use table_import::Condition;

    pub(super) fn serialize<S: Serializer>(all: &[Condition], to: S) -> Result<S::Ok, S::Error> {
        all.iter().map(Condition::text).collect::<Vec<_>>().serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Condition>, D::Error> {
        let texts = Vec::<String>::deserialize(from)?;
        texts.iter().map(|text| text.parse().map_err(Error::custom)).collect()
    }
}

/// Maps as a table: a channel's name and its expression.
mod maps {
    use serde::de::Error;
    use serde::ser::SerializeMap;
    use serde::{Deserialize, Deserializer, Serializer};
    use std::collections::BTreeMap;
    use table_import::Map;

    pub(super) fn serialize<S: Serializer>(all: &[Map], to: S) -> Result<S::Ok, S::Error> {
        let mut table = to.serialize_map(Some(all.len()))?;
        for map in all {
            table.serialize_entry(&map.left_side(), map.right_side())?;
        }
        table.end()
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<Map>, D::Error> {
        let table = BTreeMap::<String, String>::deserialize(from)?;
        table.iter().map(|(channel, text)| Map::new(channel, text).map_err(Error::custom)).collect()
    }
}

//! What a record says about itself, kept as MCAP metadata at its beginning.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::str::FromStr;

/// The texts that a run was made from, as they stood in their files.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Texts {
    /// The scenario.
    pub scenario: String,
    /// The plant's model.
    pub truth: String,
    /// The controller's model.
    pub belief: String,
}

/// What a record is of. In lockstep nothing in it may depend on the time of day, so that records agree.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RecordInfo {
    /// The scenario's name.
    pub title: String,
    /// The instance's name.
    pub instance: String,
    /// How it was run: `realtime`, `lockstep` or `in-process`.
    pub mode: String,
    /// Whether an operator moves the valve, instead of the scenario's course.
    pub operated: bool,
    /// The version of the program that made it.
    pub program_version: String,
    /// The start of the instance at which the segment begins; 0 in lockstep.
    pub generation: u64,
    /// The loop's period in ns.
    pub period_ns: u64,
    /// The angle of one micro-step, where a model with a motor gives it.
    pub microstep_rad: Option<f64>,
    /// Wall-clock time at the segment's beginning in ns since 1970, UTC; absent in lockstep.
    pub started_unix_ns: Option<u64>,
    /// Wall-clock time less the loop's clock, ns: what messages' log times are shifted by. Absent in lockstep.
    pub unix_offset_ns: Option<u64>,
    /// Scenario and models.
    pub texts: Texts,
    /// Facts of the machine by name: kernel, processor, scheduling rights and the like.
    pub machine: BTreeMap<String, String>,
}

/// The name of the metadata record with everything but texts and machine facts.
const GENERAL: &str = "stepvalve.record";
/// The name of the metadata record with the texts.
const TEXTS: &str = "stepvalve.texts";
/// The name of the metadata record with the machine's facts.
const MACHINE: &str = "stepvalve.machine";

/// The layout of these metadata. A reader refuses any other.
const FORMAT_VERSION: &str = "1";

type Entries = BTreeMap<String, String>;

impl RecordInfo {
    /// The metadata records that hold it, by name.
    pub(crate) fn to_metadata(&self) -> [(&'static str, Entries); 3] {
        let mut general = entries([
            ("format_version", FORMAT_VERSION.to_owned()),
            ("title", self.title.clone()),
            ("instance", self.instance.clone()),
            ("mode", self.mode.clone()),
            ("program_version", self.program_version.clone()),
            ("generation", self.generation.to_string()),
            ("period_ns", self.period_ns.to_string()),
        ]);
        if self.operated {
            general.insert("operated".to_owned(), "true".to_owned());
        }
        if let Some(started) = self.started_unix_ns {
            general.insert("started_unix_ns".to_owned(), started.to_string());
        }
        if let Some(offset) = self.unix_offset_ns {
            general.insert("unix_offset_ns".to_owned(), offset.to_string());
        }
        if let Some(microstep) = self.microstep_rad {
            // Debug gives the shortest text that reads back to the same bits.
            general.insert("microstep_rad".to_owned(), format!("{microstep:?}"));
        }
        let texts = entries([
            ("scenario", self.texts.scenario.clone()),
            ("truth", self.texts.truth.clone()),
            ("belief", self.texts.belief.clone()),
        ]);
        [(GENERAL, general), (TEXTS, texts), (MACHINE, self.machine.clone())]
    }

    /// The info from a file's metadata records.
    ///
    /// # Errors
    /// What was looked for and not found.
    pub(crate) fn from_metadata(records: &BTreeMap<String, Entries>) -> Result<Self, String> {
        let part = |name: &str| records.get(name).ok_or_else(|| format!("it has no metadata named {name}"));
        let (general, texts, machine) = (part(GENERAL)?, part(TEXTS)?, part(MACHINE)?);
        let version = text(general, "format_version")?;
        if version != FORMAT_VERSION {
            return Err(format!("its format_version is {version}, expected {FORMAT_VERSION}"));
        }
        let period_ns: u64 = number(general, "period_ns")?;
        if period_ns == 0 {
            return Err("its period_ns is 0".to_owned());
        }
        Ok(Self {
            title: text(general, "title")?,
            instance: text(general, "instance")?,
            mode: text(general, "mode")?,
            operated: optional_number(general, "operated")?.unwrap_or(false),
            program_version: text(general, "program_version")?,
            generation: number(general, "generation")?,
            period_ns,
            microstep_rad: optional_number(general, "microstep_rad")?,
            started_unix_ns: optional_number(general, "started_unix_ns")?,
            unix_offset_ns: optional_number(general, "unix_offset_ns")?,
            texts: Texts {
                scenario: text(texts, "scenario")?,
                truth: text(texts, "truth")?,
                belief: text(texts, "belief")?,
            },
            machine: machine.clone(),
        })
    }
}

fn entries<const N: usize>(list: [(&str, String); N]) -> Entries {
    list.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

fn text(entries: &Entries, key: &str) -> Result<String, String> {
    entries.get(key).cloned().ok_or_else(|| format!("its metadata has no {key}"))
}

fn number<T: FromStr>(entries: &Entries, key: &str) -> Result<T, String> {
    let value = text(entries, key)?;
    value.parse().map_err(|_| format!("its {key} is {value:?}, expected a number"))
}

fn optional_number<T: FromStr>(entries: &Entries, key: &str) -> Result<Option<T>, String> {
    entries.contains_key(key).then(|| number(entries, key)).transpose()
}

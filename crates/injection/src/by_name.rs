//! A process in a message between programs: by its name.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serializer};
use signals::Source;

pub(crate) fn serialize<S: Serializer>(source: &Source, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(source.name())
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Source, D::Error> {
    let name = String::deserialize(deserializer)?;
    let known = Source::ALL.iter().copied().find(|source| source.name() == name);
    known.ok_or_else(|| D::Error::custom(format!("no process \"{name}\"")))
}

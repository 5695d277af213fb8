//! A short name that is copied like a number: of effects that users add, and of their parameters.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;

/// A name of at most [`Label::MOST_BYTES`] bytes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Label {
    bytes: [u8; Self::MOST_BYTES],
    length: u8,
}

impl Label {
    /// Bytes of a name, at most.
    pub const MOST_BYTES: usize = 31;

    /// A name; `None` if it is too long.
    pub fn new(name: &str) -> Option<Self> {
        let mut bytes = [0; Self::MOST_BYTES];
        bytes.get_mut(..name.len())?.copy_from_slice(name.as_bytes());
        Some(Self { bytes, length: name.len() as u8 })
    }

    /// A name that the program itself gives; cut where it is too long.
    pub(crate) const fn fixed(name: &'static str) -> Self {
        let (mut bytes, given) = ([0; Self::MOST_BYTES], name.as_bytes());
        let length = if given.len() < Self::MOST_BYTES { given.len() } else { Self::MOST_BYTES };
        bytes.split_at_mut(length).0.copy_from_slice(given.split_at(length).0);
        Self { bytes, length: length as u8 }
    }

    /// The name.
    pub fn as_str(&self) -> &str {
        self.bytes.get(..usize::from(self.length)).and_then(|bytes| str::from_utf8(bytes).ok()).unwrap_or("")
    }
}

impl From<&'static str> for Label {
    fn from(name: &'static str) -> Self {
        Self::fixed(name)
    }
}

impl PartialEq<str> for Label {
    fn eq(&self, other: &str) -> bool {
        self.as_str() == other
    }
}

impl PartialEq<&str> for Label {
    fn eq(&self, other: &&str) -> bool {
        self.as_str() == *other
    }
}

impl fmt::Debug for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl Serialize for Label {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for Label {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::new(&name).ok_or_else(|| de::Error::invalid_length(name.len(), &"at most 31 bytes"))
    }
}

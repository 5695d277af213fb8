//! Messages that are not in a record: which, and how that is known.

use crate::Topic;

/// A run of messages of one publisher that never reached the recorder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Gap {
    /// Where they were published.
    pub topic: Topic,
    /// The start of the instance that published them.
    pub generation: u64,
    /// The sequence number of the first one missing.
    pub first_missing: u64,
    /// How many are missing.
    pub missed: u64,
}

/// How a gap came to be known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum GapOrigin {
    /// The recorder noticed and declared it.
    Declared,
    /// Published between the last message of one segment and the first of the next: the recorder was not there.
    BetweenSegments,
    /// Nobody declared it: the file is damaged, or the recorder is at fault.
    Undeclared,
}

impl GapOrigin {
    /// The name for people and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Declared => "declared",
            Self::BetweenSegments => "between segments",
            Self::Undeclared => "undeclared",
        }
    }
}

/// A gap, and how it is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct KnownGap {
    /// What is missing.
    pub gap: Gap,
    /// How that is known.
    pub origin: GapOrigin,
}

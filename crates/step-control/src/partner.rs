//! How long a partner has been silent.

use serde::{Deserialize, Serialize};

/// Cycles in a row without a valid message of one partner.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Partner {
    silent_cycles: u64,
}

impl Partner {
    /// Notes whether this cycle's message has arrived.
    pub(crate) fn note(&mut self, heard: bool) {
        self.silent_cycles = if heard { 0 } else { self.silent_cycles.saturating_add(1) };
    }

    pub(crate) fn silent_cycles(self) -> u64 {
        self.silent_cycles
    }

    /// Whether the partner counts as dead.
    pub(crate) fn silent(self, limit_cycles: u64) -> bool {
        self.silent_cycles >= limit_cycles
    }
}

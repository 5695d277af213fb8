//! Faults of a whole process: it takes too long for a cycle, or says nothing any more.

use injection::{Fault, Injection};
use signals::Source;

/// What is to go wrong in this process, as it was told.
#[derive(Debug, Default)]
pub(crate) struct ProcessFaults {
    waiting: Vec<Injection>,
    silent_from: Option<u64>,
}

impl ProcessFaults {
    /// Takes a fault in; one of the messages alone is none here.
    pub(crate) fn add(&mut self, source: Source, injection: &Injection) {
        match injection.fault {
            Fault::Overrun { process, .. } if process == source => self.waiting.push(injection.clone()),
            Fault::Silence { process } if process == source => {
                self.silent_from = Some(self.silent_from.map_or(injection.at, |at| at.min(injection.at)));
            }
            _ => {}
        }
    }

    /// Cycles that this one takes too long, once.
    pub(crate) fn overrun(&mut self, cycle: u64) -> u64 {
        let due = self.waiting.iter().position(|injection| injection.at <= cycle);
        match due.map(|index| self.waiting.swap_remove(index).fault) {
            Some(Fault::Overrun { cycles, .. }) => cycles,
            _ => 0,
        }
    }

    /// Whether the process says nothing any more.
    pub(crate) fn silent(&self, cycle: u64) -> bool {
        self.silent_from.is_some_and(|from| cycle >= from)
    }
}

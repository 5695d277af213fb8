//! What the terminal shows: the newest status, a short history of some of its numbers, the last events.

use std::collections::{BTreeMap, VecDeque};
use supervisor::{Entry, Status};

/// Looks that are kept: 30 s of them.
const HISTORY: usize = 300;
/// Events that are kept.
const EVENTS: usize = 100;

/// The view.
#[derive(Debug, Default)]
pub(super) struct View {
    /// The newest status; `None` before the first.
    pub(super) status: Option<Status>,
    /// Why there is no newer one.
    pub(super) silent: Option<String>,
    /// Magnitudes of the following error, in rad, the newest last.
    pub(super) errors_rad: VecDeque<f64>,
    /// Largest wake-up latencies by process, in µs, the newest last.
    pub(super) latencies_us: BTreeMap<String, VecDeque<f64>>,
    /// The last events, the newest last.
    pub(super) events: VecDeque<Entry>,
}

impl View {
    /// A new status came.
    pub(super) fn take(&mut self, status: Status) {
        keep(&mut self.errors_rad, status.following_error_rad.abs(), HISTORY);
        for (name, process) in &status.processes {
            let history = self.latencies_us.entry(name.clone()).or_default();
            keep(history, process.wake_up_latency_us, HISTORY);
        }
        self.silent = None;
        self.status = Some(status);
    }

    /// No status came.
    pub(super) fn unanswered(&mut self, why: String) {
        self.silent = Some(why);
    }

    /// Events came.
    pub(super) fn take_events(&mut self, entries: Vec<Entry>) {
        for entry in entries {
            keep(&mut self.events, entry, EVENTS);
        }
    }
}

fn keep<T>(history: &mut VecDeque<T>, value: T, most: usize) {
    if history.len() == most {
        history.pop_front();
    }
    history.push_back(value);
}

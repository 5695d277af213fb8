//! Progress of a run: a bar on a terminal, a line every few seconds elsewhere.

use closed_loop::Timeline;
use indicatif::{ProgressBar, ProgressStyle};
use processes::complain;
use std::cell::Cell;
use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

/// From one line to the next.
const LINES_APART: Duration = Duration::from_secs(5);

/// How far a run's cycles are, on stderr.
pub struct Progress {
    bar: ProgressBar,
    cycles: u64,
    /// Whether a cycle was told of: what is left is estimated from the first one on, not from the start of the processes.
    begun: Cell<bool>,
    /// When a line was written last; `None` where there is a bar, or nothing to tell.
    told: Option<Cell<Instant>>,
}

impl Progress {
    /// Of all cycles of `timeline`; nothing for one without an end.
    pub fn new(timeline: &Timeline) -> Self {
        let cycles = timeline.last_cycle.saturating_add(1);
        if timeline.last_cycle == u64::MAX {
            return Self { bar: ProgressBar::hidden(), cycles, begun: Cell::new(true), told: None };
        }
        let told = (!stderr().is_terminal()).then(|| Cell::new(Instant::now()));
        let bar = ProgressBar::new(cycles);
        if let Ok(style) =
            ProgressStyle::with_template("{bar:40} cycle {pos} of {len}, {elapsed}, {eta} left")
        {
            bar.set_style(style);
        }
        Self { bar, cycles, begun: Cell::new(false), told }
    }

    /// The run is in this cycle.
    pub fn at(&self, cycle: u64) {
        // Drawing is limited by the bar itself; asking it every cycle would still cost more than the cycle.
        if cycle.is_multiple_of(1024) {
            self.set(cycle);
        }
    }

    /// The run is in this cycle, asked seldom.
    pub fn set(&self, cycle: u64) {
        if !self.begun.replace(true) {
            self.bar.reset();
        }
        self.bar.set_position(cycle);
        if let Some(told) = &self.told
            && told.get().elapsed() >= LINES_APART
        {
            told.set(Instant::now());
            let percent = 100.0 * cycle as f64 / self.cycles as f64;
            complain(format_args!("cycle {cycle} of {}, {percent:.0} %", self.cycles));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

//! Progress of a run on a terminal; silent elsewhere.

use closed_loop::Timeline;
use indicatif::{ProgressBar, ProgressStyle};

/// A bar over the run's cycles on stderr, if that is a terminal.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A bar for all cycles of `timeline`; none for one without an end.
    pub fn new(timeline: &Timeline) -> Self {
        if timeline.last_cycle == u64::MAX {
            return Self { bar: ProgressBar::hidden() };
        }
        let bar = ProgressBar::new(timeline.last_cycle + 1);
        if let Ok(style) =
            ProgressStyle::with_template("{bar:40} cycle {pos} of {len}, {elapsed}, {eta} left")
        {
            bar.set_style(style);
        }
        Self { bar }
    }

    /// The run is in this cycle.
    pub fn at(&self, cycle: u64) {
        // Drawing is limited by the bar itself; asking it every cycle would still cost more than the cycle.
        if cycle.is_multiple_of(1024) {
            self.bar.set_position(cycle);
        }
    }

    /// The run is in this cycle, asked seldom.
    pub fn set(&self, cycle: u64) {
        self.bar.set_position(cycle);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

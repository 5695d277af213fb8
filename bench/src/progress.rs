//! What is being measured, on a terminal; silent elsewhere.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar over the measurements of a bench.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A bar over so many measurements.
    pub fn new(measurements: usize) -> Self {
        let bar = ProgressBar::new(measurements as u64);
        if let Ok(style) = ProgressStyle::with_template("{bar:20} {pos} of {len}, {elapsed}: {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(std::time::Duration::from_millis(500));
        Self { bar }
    }

    /// The next measurement begins.
    pub fn next(&self, what: impl Into<String>) {
        self.bar.set_message(what.into());
        self.bar.inc(1);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

//! What is being measured: a bar on a terminal, elsewhere a line every half minute.

use indicatif::{ProgressBar, ProgressStyle};
use std::cell::Cell;
use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

/// Between two lines where no terminal is.
const PAUSE: Duration = Duration::from_secs(30);

/// A bar over the measurements of a bench.
pub struct Progress {
    bar: ProgressBar,
    /// When the last line was written; `None` on a terminal, which has the bar.
    said: Option<Cell<Instant>>,
}

impl Progress {
    /// A bar over so many measurements.
    pub fn new(measurements: usize) -> Self {
        let bar = ProgressBar::new(measurements as u64);
        if let Ok(style) = ProgressStyle::with_template("{bar:20} {pos} of {len}, {elapsed}: {msg}") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(500));
        Self { bar, said: (!stderr().is_terminal()).then(|| Cell::new(Instant::now())) }
    }

    /// The next measurement begins.
    pub fn next(&self, what: impl Into<String>) {
        let what = what.into();
        if let Some(said) = self.said.as_ref().filter(|said| said.get().elapsed() >= PAUSE) {
            let (at, of) = (self.bar.position() + 1, self.bar.length().unwrap_or(0));
            eprintln!("{at} of {of}, {} s: {what}", self.bar.elapsed().as_secs());
            said.set(Instant::now());
        }
        self.bar.set_message(what);
        self.bar.inc(1);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

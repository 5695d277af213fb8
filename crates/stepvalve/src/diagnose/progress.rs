//! How far a diagnosis is: a line that changes on a terminal, a line for each step elsewhere.

use crate::say::say;
use diagnosis::Event;
use indicatif::{ProgressBar, ProgressStyle};
use processes::complain;
use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

/// Causes of the first ranking that are told.
const FIRST: usize = 5;

/// Tells what is being done. Dropped, it leaves the terminal as it was.
pub struct Progress {
    bar: Option<ProgressBar>,
    begun: Instant,
}

impl Progress {
    /// Begins to tell.
    pub fn new() -> Self {
        let bar = stderr().is_terminal().then(|| {
            let bar = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        Self { bar, begun: Instant::now() }
    }

    /// A step begins.
    pub fn step(&self, what: &'static str) {
        match &self.bar {
            Some(bar) => bar.set_message(what),
            // Files of jobs are read later: lines with their time.
            None => complain(format_args!("{:7.1} s  {what}", self.begun.elapsed().as_secs_f64())),
        }
    }

    /// Tells what the diagnosis has come to.
    pub fn show(&self, event: Event<'_>) {
        match event {
            Event::Noise { rms, noise } => self.aside(|| {
                say(format_args!("error of the model: RMS {rms:.4e}; noise {noise:.4e}"));
            }),
            Event::Ranking(ranking) => self.aside(|| {
                say("first ranking, by what each cause alone would cut the error (in parts of the noise):");
                for (id, gain) in ranking.iter().take(FIRST).filter(|(_, gain)| *gain > 0.0) {
                    say(format_args!("  {gain:8.3}  {id}"));
                }
            }),
            Event::Step(step) => self.step(step),
        }
    }

    /// All is done.
    pub fn end(self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn aside(&self, tell: impl FnOnce()) {
        match &self.bar {
            Some(bar) => bar.suspend(tell),
            None => tell(),
        }
    }
}

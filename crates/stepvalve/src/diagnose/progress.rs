//! How far a diagnosis is: a line that changes on a terminal; elsewhere a line for each step, and while a step goes on.

use crate::pulse::Pulse;
use crate::say::say;
use diagnosis::Event;
use indicatif::{ProgressBar, ProgressStyle};
use processes::complain;
use std::cell::Cell;
use std::io::{IsTerminal, stderr};
use std::time::Duration;
use study::words;

/// Causes of the first ranking that are told.
const FIRST: usize = 5;
/// Smaller gains are shown as none.
const SEEN: f64 = 5e-4;

/// Tells what is being done. Dropped, it leaves the terminal as it was.
pub struct Progress {
    /// On a terminal it is drawn; elsewhere it holds the time and the step.
    bar: ProgressBar,
    drawn: bool,
    /// Of what is predicted.
    unit: &'static str,
    /// Why the search has begun anew.
    again: Cell<Option<&'static str>>,
    /// Only steps are told.
    quiet: bool,
    _pulse: Pulse,
}

impl Progress {
    /// Begins to tell of a channel with this unit.
    pub fn new(unit: &'static str, quiet: bool) -> Self {
        let drawn = stderr().is_terminal();
        let bar = if drawn { ProgressBar::new_spinner() } else { ProgressBar::hidden() };
        if let (true, Ok(style)) = (drawn, ProgressStyle::with_template("{spinner} {elapsed} {msg}")) {
            bar.set_style(style);
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        let shown = bar.clone();
        let pulse = Pulse::new(move || format!("still: {}", shown.message()));
        Self { bar, drawn, unit, again: Cell::new(None), quiet, _pulse: pulse }
    }

    /// A step begins.
    pub fn step(&self, what: &'static str) {
        self.bar.set_message(what);
        if !self.drawn {
            // Files of jobs are read later: lines with their time.
            complain(format_args!("{:7.1} s  {what}", self.bar.elapsed().as_secs_f64()));
        }
    }

    /// Tells what the diagnosis has come to.
    pub fn show(&self, event: Event<'_>) {
        match event {
            Event::Noise { rms, noise } => self.aside(|| {
                let (rms, noise) = (words::short(rms), words::short(noise));
                say(format_args!("first estimates: error of the model {rms}, noise {noise} ({}, RMS); the report has them of all samples", self.unit));
            }),
            Event::Ranking(ranking) => self.aside(|| {
                let look = self.again.get().unwrap_or("first look");
                say(format_args!("{look}: what each cause alone would cut the error by, to first order (1 is as much as the noise):"));
                for (id, gain) in ranking.iter().take(FIRST).filter(|(_, gain)| *gain >= SEEN) {
                    say(format_args!("  {gain:8.3}  {id}"));
                }
            }),
            Event::Bound { simulated, at_most } => {
                let elapsed_s = self.bar.elapsed().as_secs_f64();
                let left_s = elapsed_s / simulated.max(1) as f64 * at_most.saturating_sub(simulated) as f64;
                self.aside(|| {
                    complain(format_args!(
                        "{elapsed_s:7.1} s  at most about {left_s:.0} s more, most logs far less; --limit TIME ends it sooner"
                    ));
                });
            }
            Event::Step(step) => self.step(step),
            Event::Again(step) => {
                self.again.set(Some(step));
                self.step(step);
            }
        }
    }

    /// All is done.
    pub fn end(self) {
        self.bar.finish_and_clear();
    }

    fn aside(&self, tell: impl FnOnce()) {
        if !self.quiet {
            self.bar.suspend(tell);
        }
    }
}

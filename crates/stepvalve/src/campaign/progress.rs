//! How far a campaign is: a bar on a terminal, a line every few seconds elsewhere; both with the time that is left.

use crate::pulse::Pulse;
use indicatif::{ProgressBar, ProgressStyle};
use std::time::{Duration, Instant};

/// Of so many runs.
pub struct Progress {
    bar: ProgressBar,
    _pulse: Pulse,
}

impl Progress {
    /// Of `all`, some of which were made before: they say nothing about the time that is left.
    pub fn new(all: u64, before: u64) -> Self {
        let bar = ProgressBar::new(all).with_position(before);
        if let Ok(style) = ProgressStyle::with_template("{bar:40} run {pos} of {len}, {elapsed}, {eta} left")
        {
            bar.set_style(style);
        }
        bar.reset_eta();
        let (shown, begun) = (bar.clone(), Instant::now());
        let pulse = Pulse::new(move || line(shown.position(), before, all, begun.elapsed()));
        Self { bar, _pulse: pulse }
    }

    /// A run is made.
    pub fn one_more(&self) {
        self.bar.inc(1);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

fn line(position: u64, before: u64, all: u64, elapsed: Duration) -> String {
    let per_s = (position - before) as f64 / elapsed.as_secs_f64();
    let counted = format!("{position} of {all} runs");
    if position == before {
        return counted;
    }
    let left_s = (all - position) as f64 / per_s;
    let left = match left_s {
        left_s if left_s < 100.0 => format!("{left_s:.0} s"),
        left_s if left_s < 6000.0 => format!("{:.0} min", left_s / 60.0),
        left_s => format!("{:.1} h", left_s / 3600.0),
    };
    let decimals = if per_s < 10.0 { 2 } else { 0 };
    format!("{counted}, {per_s:.decimals$} a second, about {left} left")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_counts_from_this_start() {
        let line = |position, s| line(position, 100, 1100, Duration::from_secs(s));
        assert_eq!(line(100, 3), "100 of 1100 runs");
        assert_eq!(line(200, 4), "200 of 1100 runs, 25 a second, about 36 s left");
        assert_eq!(line(110, 10), "110 of 1100 runs, 1.00 a second, about 16 min left");
        assert_eq!(line(101, 60), "101 of 1100 runs, 0.02 a second, about 16.6 h left");
    }
}

//! When a recorder that died is replaced, and when no more: later each time, so that one that can't live does not eat the
//! machine, and in the end never, since a valve turns without a record too.

use std::time::{Duration, Instant};

/// The second death is followed by a successor after this; each further one after twice the time before,
const FIRST_PAUSE: Duration = Duration::from_millis(100);
/// but never more than this.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);
/// One that lived so long was able to.
const LONG_LIFE: Duration = Duration::from_secs(60);
/// After so many deaths one after the other nothing is recorded any more: 6 s at the least after the first.
const MAX_DEATHS: u32 = 8;

/// The recorders of a generation.
#[derive(Debug, Default)]
pub struct RecorderKeeper {
    restarts: u32,
    deaths_in_a_row: u32,
    started: Option<Instant>,
    due: Option<Instant>,
    given_up: bool,
}

impl RecorderKeeper {
    /// A recorder was started.
    pub fn started(&mut self, now: Instant) {
        self.started = Some(now);
        self.due = None;
    }

    /// The recorder died. The pause until its successor; `None` for no more.
    pub fn died(&mut self, now: Instant) -> Option<Duration> {
        let lived_long = self.started.is_some_and(|started| now.duration_since(started) >= LONG_LIFE);
        self.deaths_in_a_row = if lived_long { 1 } else { self.deaths_in_a_row + 1 };
        if self.deaths_in_a_row >= MAX_DEATHS {
            self.given_up = true;
            return None;
        }
        let pause = match self.deaths_in_a_row {
            1 => Duration::ZERO,
            deaths => (FIRST_PAUSE * (1 << (deaths - 2).min(16))).min(LONGEST_PAUSE),
        };
        self.due = Some(now + pause);
        Some(pause)
    }

    /// Whether a successor is to be started now. Once this says so, it is.
    pub fn take_due(&mut self, now: Instant) -> bool {
        let due = self.due.is_some_and(|due| now >= due);
        if due {
            self.due = None;
            self.restarts += 1;
        }
        due
    }

    /// How often a recorder was replaced.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Whether nothing is recorded any more.
    pub fn given_up(&self) -> bool {
        self.given_up
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn successors_come_later_each_time_and_then_no_more() {
        let mut keeper = RecorderKeeper::default();
        let mut now = Instant::now();
        let mut pauses = Vec::new();
        keeper.started(now);
        while let Some(pause) = keeper.died(now) {
            assert!(pause.is_zero() || !keeper.take_due(now), "not before its time");
            now += pause;
            assert!(keeper.take_due(now) && !keeper.take_due(now), "once");
            keeper.started(now);
            pauses.push(pause.as_millis());
        }
        assert_eq!(pauses, [0, 100, 200, 400, 800, 1600, 3200]);
        assert!(keeper.given_up());
        assert_eq!(keeper.restarts(), 7);
    }

    #[test]
    fn one_that_lived_long_is_replaced_at_once() {
        let mut keeper = RecorderKeeper::default();
        let mut now = Instant::now();
        for _ in 0..100 {
            keeper.started(now);
            now += LONG_LIFE;
            assert_eq!(keeper.died(now), Some(Duration::ZERO));
        }
    }
}

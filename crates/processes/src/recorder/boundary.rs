//! Where a segment ends: at a cycle before which the controller states its whole state, so that the next begins with it.
//!
//! Services are read one after the other, so messages from both sides of the boundary come mixed. Each goes to the side of the
//! cycle in which it was published, and the old segment stays open until none can come any more.

use closed_loop::snapshot_every_cycles;

/// Rounds of reading after which everything published before the first of them has been read.
const WHOLE_ROUNDS: u32 = 2;

/// The boundary ahead, and the one just crossed.
#[derive(Debug)]
pub(crate) struct Boundary {
    every_cycles: u64,
    state_before: Option<u64>,
    newest_cycle: u64,
    planned: Option<u64>,
    crossed: u64,
    rounds_since: u32,
}

impl Boundary {
    /// None is planned.
    pub(crate) fn new(period_ns: u64) -> Self {
        Self {
            every_cycles: snapshot_every_cycles(period_ns as f64 * 1e-9),
            state_before: None,
            newest_cycle: 0,
            planned: None,
            crossed: 0,
            rounds_since: 0,
        }
    }

    /// The controller stated its state before this cycle.
    pub(crate) fn state_was_taken(&mut self, before_cycle: u64) {
        self.state_before = Some(before_cycle);
    }

    /// The newest cycle in which a message was published.
    pub(crate) fn newest_cycle(&self) -> u64 {
        self.newest_cycle
    }

    /// The segment is full: it ends before the next cycle whose state will be stated and of which nothing has come yet, or
    /// right away where no state was ever stated.
    pub(crate) fn plan(&mut self) {
        let next = self.newest_cycle.saturating_add(1);
        let states_until = |taken: u64| next.saturating_sub(taken).div_ceil(self.every_cycles);
        let cycle = self.state_before.map_or(next, |taken| {
            taken.saturating_add(states_until(taken).saturating_mul(self.every_cycles))
        });
        self.planned.get_or_insert(cycle);
    }

    /// The segment ends before the next message, whatever its cycle: the boundary that was planned was never reached.
    pub(crate) fn plan_at_once(&mut self) {
        self.planned = Some(0);
    }

    /// A message published in this cycle has come: the planned boundary, where this is the first message behind it.
    pub(crate) fn crossed(&mut self, cycle: u64) -> Option<u64> {
        self.newest_cycle = self.newest_cycle.max(cycle);
        let boundary = self.planned.take_if(|planned| *planned <= cycle)?;
        self.crossed = boundary;
        self.rounds_since = 0;
        Some(boundary)
    }

    /// Asked between rounds of reading: whether all messages of cycles before the boundary have been read.
    pub(crate) fn all_have_come(&mut self) -> bool {
        if self.newest_cycle > self.crossed {
            self.rounds_since += 1;
        }
        self.rounds_since >= WHOLE_ROUNDS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_ends_where_the_next_state_is_stated() {
        // Period in ms, last state, newest cycle, expected boundary.
        let cases = [
            (1, None, 1700, 1701),
            (1, Some(0), 999, 1000),
            (1, Some(0), 1000, 2000),
            (1, Some(1003), 1700, 2003),
            (1, Some(1003), 5004, 6003),
            (3, Some(334), 500, 668),
            (2000, Some(5), 7, 8),
        ];
        for (period_ms, state, newest, expected) in cases {
            let mut boundary = Boundary::new(period_ms * 1_000_000);
            assert_eq!(boundary.crossed(newest), None, "nothing is planned");
            if let Some(cycle) = state {
                boundary.state_was_taken(cycle);
            }
            boundary.plan();
            // What is planned stays planned, whatever comes before it.
            boundary.state_was_taken(newest);
            boundary.plan();
            assert_eq!(boundary.crossed(expected - 1), None, "{state:?}, {newest}");
            assert_eq!(boundary.crossed(expected + 1), Some(expected), "{state:?}, {newest}");
            assert_eq!(boundary.crossed(expected + 1), None, "crossed once");
        }
        let mut lost = Boundary::new(1_000_000);
        lost.state_was_taken(1000);
        lost.crossed(u64::MAX);
        lost.plan();
        assert_eq!(lost.crossed(1001), None);
        lost.plan_at_once();
        assert_eq!(lost.crossed(1002), Some(0));
    }

    #[test]
    fn the_old_segment_waits_for_what_was_published_before_the_boundary() {
        let mut boundary = Boundary::new(1_000_000);
        boundary.crossed(10);
        boundary.plan();
        assert_eq!(boundary.crossed(11), Some(11));
        // What comes late in cycle 10 may be published after what comes early in cycle 11.
        assert!((0..10).all(|_| !boundary.all_have_come()));
        boundary.crossed(12);
        assert_eq!([(); 3].map(|()| boundary.all_have_come()), [false, true, true]);
    }
}

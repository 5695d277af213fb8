//! The last seconds of all messages: what a trigger's past, a signal that is looked at anew, and captures come from.

use crate::block::{Block, Stored, has_cycle};
use recording::Gap;
use std::collections::VecDeque;

/// A block is closed at this size, so that the oldest goes in small pieces. All blocks are alike, however much came at once after a
/// stall: a block that grew would keep its memory as long as the history lasts.
const BLOCK_BYTES: usize = 256 << 10;
/// Room for the message that closes it.
const ROOM_BYTES: usize = 4 << 10;
/// Messages in a block: most are larger than 96 bytes.
const BLOCK_MESSAGES: usize = BLOCK_BYTES / 96;
/// Gaps that are remembered; more than these are counted all the same.
const GAPS: usize = 1000;

/// Messages that never came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lost {
    /// Which they were.
    pub(crate) gap: Gap,
    /// The cycle of the message behind them.
    pub(crate) before_cycle: u64,
}

/// The last cycles of one generation.
#[derive(Debug)]
pub(crate) struct History {
    cycles: u64,
    closed: VecDeque<(u64, Block)>,
    open: Block,
    spare: Option<Block>,
    lost: VecDeque<Lost>,
    first_cycle: Option<u64>,
    newest_cycle: u64,
}

impl History {
    /// Holds the last `cycles`.
    pub(crate) fn new(cycles: u64) -> Self {
        Self {
            cycles,
            closed: VecDeque::new(),
            open: Block::with_room(BLOCK_BYTES + ROOM_BYTES, BLOCK_MESSAGES),
            spare: None,
            lost: VecDeque::new(),
            first_cycle: None,
            newest_cycle: 0,
        }
    }

    /// Forgets everything and holds so many cycles from now on.
    pub(crate) fn restart(&mut self, cycles: u64) {
        *self = Self::new(cycles);
    }

    /// Takes what came.
    pub(crate) fn take(&mut self, came: &Block, lost: &[Lost]) {
        for stored in came.iter() {
            if has_cycle(stored.topic) {
                self.first_cycle.get_or_insert(stored.cycle);
                self.newest_cycle = self.newest_cycle.max(stored.cycle);
            }
            self.open.push(stored.topic, stored.cycle, |bytes| bytes.extend_from_slice(stored.bytes));
            if self.open.len() >= BLOCK_BYTES {
                self.close();
            }
        }
        for lost in lost {
            if self.lost.len() == GAPS {
                self.lost.pop_front();
            }
            self.lost.push_back(*lost);
        }
        self.forget();
    }

    /// Goes on with the next block: one that was forgotten, or a new one.
    fn close(&mut self) {
        let next =
            self.spare.take().unwrap_or_else(|| Block::with_room(BLOCK_BYTES + ROOM_BYTES, BLOCK_MESSAGES));
        self.closed.push_back((self.newest_cycle, std::mem::replace(&mut self.open, next)));
    }

    fn forget(&mut self) {
        let oldest = self.newest_cycle.saturating_sub(self.cycles);
        while let Some((newest, _)) = self.closed.front()
            && *newest < oldest
        {
            // One is kept: blocks come and go one by one.
            if let Some((_, mut block)) = self.closed.pop_front() {
                block.clear();
                self.spare = Some(block);
            }
        }
        while self.lost.front().is_some_and(|lost| lost.before_cycle < oldest) {
            self.lost.pop_front();
        }
    }

    /// All messages, the oldest first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = Stored<'_>> {
        self.closed.iter().flat_map(|(_, block)| block.iter()).chain(self.open.iter())
    }

    /// What is known to be lost among them.
    pub(crate) fn lost(&self) -> impl Iterator<Item = &Lost> {
        self.lost.iter()
    }

    /// The oldest cycle that is still whole; `None` while there is none.
    pub(crate) fn oldest_cycle(&self) -> Option<u64> {
        let first = self.first_cycle?;
        Some(first.max(self.newest_cycle.saturating_sub(self.cycles)))
    }

    /// The newest cycle that any message spoke of.
    pub(crate) fn newest_cycle(&self) -> u64 {
        self.newest_cycle
    }

    /// The messages of the cycles from `from` to `to`, both included, with the orders that were given meanwhile.
    pub(crate) fn cut(&self, from: u64, to: u64) -> (Block, Vec<Lost>) {
        let mut block = Block::default();
        let within = |stored: &Stored<'_>| has_cycle(stored.topic) && (from..=to).contains(&stored.cycle);
        let times = || self.iter().filter(within).map(|stored| stored.published_ns());
        let (begin, end) = (times().min().unwrap_or(0), times().max().unwrap_or(0));
        let ordered =
            |stored: &Stored<'_>| !has_cycle(stored.topic) && (begin..=end).contains(&stored.published_ns());
        for stored in self.iter().filter(|stored| within(stored) || ordered(stored)) {
            block.push(stored.topic, stored.cycle, |bytes| bytes.extend_from_slice(stored.bytes));
        }
        let lost = self.lost.iter().filter(|lost| (from..=to).contains(&lost.before_cycle)).copied();
        (block, lost.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use recording::Topic;

    fn came(cycles: std::ops::Range<u64>) -> Block {
        let mut block = Block::default();
        for cycle in cycles {
            block.push(Topic::Feedback, cycle, |bytes| bytes.extend_from_slice(&[cycle as u8; 200]));
        }
        block
    }

    #[test]
    fn it_holds_the_last_cycles_and_no_more() {
        let mut history = History::new(5000);
        for start in (0..50_000).step_by(10) {
            history.take(&came(start..start + 10), &[]);
        }
        let held: Vec<_> = history.iter().map(|stored| stored.cycle).collect();
        assert_eq!(history.oldest_cycle(), Some(44_999));
        assert!(
            held[0] <= 44_999 && held.len() < 5000 + 2 * BLOCK_BYTES / 200,
            "{} from {}",
            held.len(),
            held[0]
        );
        assert!(held.is_sorted());
    }

    #[test]
    fn a_cut_has_each_of_its_cycles_once() {
        let mut history = History::new(5000);
        (0..3000).step_by(10).for_each(|start| history.take(&came(start..start + 10), &[]));
        let (cut, _) = history.cut(1234, 2345);
        let cycles: Vec<_> = cut.iter().map(|stored| stored.cycle).collect();
        assert_eq!(cycles, (1234..=2345).collect::<Vec<_>>());
    }

    #[test]
    fn a_burst_leaves_no_larger_block_behind() {
        let mut history = History::new(5000);
        let burst = 3 * BLOCK_BYTES as u64 / 200;
        history.take(&came(0..burst), &[]);
        (burst..burst + 20_000).step_by(10).for_each(|start| history.take(&came(start..start + 10), &[]));
        history.take(&came(burst + 20_000..2 * burst + 20_000), &[]);
        let all = history.closed.iter().map(|(_, block)| block).chain([&history.open]).chain(&history.spare);
        all.for_each(|block| assert_eq!(block.room(), BLOCK_BYTES + ROOM_BYTES));
        assert!(history.iter().map(|stored| stored.cycle).is_sorted());
    }
}

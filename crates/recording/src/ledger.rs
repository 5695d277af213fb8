//! Keeps account of every publisher's sequence numbers: recorded plus missing is what was published.

use crate::{Gap, GapOrigin, KnownGap, Topic};
use std::collections::BTreeMap;

/// What became of the messages of one topic in one generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Messages read, each once.
    pub recorded: u64,
    /// Messages missing up to the last one recorded or declared missing; the gaps say which.
    pub missed: u64,
    /// Messages that came again (a recorder that starts anew gets the newest once more); left out.
    pub repeated: u64,
}

/// A publisher: a topic in a generation.
type Key = (Topic, u64);

#[derive(Default)]
struct Account {
    tally: Tally,
    /// The sequence number expected next.
    next: u64,
    /// The segment of the last message.
    segment: usize,
    /// What the sequence numbers show to be missing.
    holes: Vec<Hole>,
    /// What the recorder declared to be missing: first, and first not.
    declared: Vec<(u64, u64)>,
}

#[derive(Clone, Copy)]
struct Hole {
    first: u64,
    end: u64,
    between_segments: bool,
}

/// The accounts of all publishers.
#[derive(Default)]
pub(crate) struct Ledger {
    accounts: BTreeMap<Key, Account>,
}

impl Ledger {
    /// Takes note of a message; false where it has been there before.
    pub(crate) fn message(&mut self, topic: Topic, generation: u64, sequence: u64, segment: usize) -> bool {
        let account = self.accounts.entry((topic, generation)).or_default();
        if sequence < account.next {
            account.tally.repeated += 1;
            return false;
        }
        if sequence > account.next {
            let between_segments = account.segment != segment;
            account.holes.push(Hole { first: account.next, end: sequence, between_segments });
        }
        account.next = sequence.saturating_add(1);
        account.segment = segment;
        account.tally.recorded += 1;
        true
    }

    /// Takes note of a gap that the recorder declared.
    pub(crate) fn gap(&mut self, gap: &Gap) {
        let account = self.accounts.entry((gap.topic, gap.generation)).or_default();
        account.declared.push((gap.first_missing, gap.first_missing.saturating_add(gap.missed)));
    }

    /// The accounts' tallies, and all gaps in the order of topic, generation and sequence.
    pub(crate) fn close(self) -> (BTreeMap<Key, Tally>, Vec<KnownGap>) {
        let mut gaps = Vec::new();
        let mut tallies = BTreeMap::new();
        for ((topic, generation), mut account) in self.accounts {
            account.declared.sort_unstable();
            let pieces = account.pieces();
            account.tally.missed = pieces.iter().map(|(first, end, _)| end - first).sum();
            gaps.extend(pieces.into_iter().map(|(first_missing, end, origin)| {
                let gap = Gap { topic, generation, first_missing, missed: end - first_missing };
                KnownGap { gap, origin }
            }));
            tallies.insert((topic, generation), account.tally);
        }
        (tallies, gaps)
    }
}

impl Account {
    /// The holes, cut where declarations begin and end, and what is declared behind the last message.
    fn pieces(&self) -> Vec<(u64, u64, GapOrigin)> {
        let mut pieces = Vec::new();
        for hole in &self.holes {
            let rest = if hole.between_segments { GapOrigin::BetweenSegments } else { GapOrigin::Undeclared };
            let mut at = hole.first;
            for (first, end) in self.declared_within(hole.first, hole.end) {
                push(&mut pieces, at, first.max(at), rest);
                push(&mut pieces, first.max(at), end, GapOrigin::Declared);
                at = at.max(end);
            }
            push(&mut pieces, at, hole.end, rest);
        }
        let mut at = self.next;
        for (first, end) in self.declared_within(self.next, u64::MAX) {
            push(&mut pieces, first.max(at), end, GapOrigin::Declared);
            at = at.max(end);
        }
        pieces
    }

    /// Declarations, clipped to a range, in order.
    fn declared_within(&self, low: u64, high: u64) -> impl Iterator<Item = (u64, u64)> {
        let clipped = self.declared.iter().map(move |(first, end)| (*first.max(&low), *end.min(&high)));
        clipped.filter(|(first, end)| first < end)
    }
}

fn push(pieces: &mut Vec<(u64, u64, GapOrigin)>, first: u64, end: u64, origin: GapOrigin) {
    if first < end {
        pieces.push((first, end, origin));
    }
}

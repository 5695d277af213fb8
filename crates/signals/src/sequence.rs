//! Gaps, repetitions and old messages, told from a service's sequence numbers.

/// What a message's sequence number says about its arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrival {
    /// The first message, or the one after the last.
    Next,
    /// This many messages were lost before it.
    Gap(u64),
    /// The same message as the last one.
    Repeated,
    /// A message from before the last one: reordered or replayed.
    Old,
}

/// Follows the sequence numbers of one publisher.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SequenceTracker {
    next: Option<u64>,
    received: u64,
    missed: u64,
}

impl SequenceTracker {
    /// Takes note of a received sequence number. The first one of a reader is never a gap: what was published
    /// before it came is not its loss (the recorder counts from zero instead, with [`Self::from_start`]).
    pub fn note(&mut self, sequence: u64) -> Arrival {
        let arrival = match self.next {
            None => Arrival::Next,
            Some(next) if sequence == next => Arrival::Next,
            Some(next) if sequence > next => Arrival::Gap(sequence - next),
            Some(next) if sequence.wrapping_add(1) == next => Arrival::Repeated,
            Some(_) => Arrival::Old,
        };
        if let Arrival::Next | Arrival::Gap(_) = arrival {
            self.next = Some(sequence.wrapping_add(1));
            self.received += 1;
        }
        if let Arrival::Gap(lost) = arrival {
            self.missed += lost;
        }
        arrival
    }

    /// A tracker for a reader that was there from the first message on.
    pub fn from_start() -> Self {
        Self { next: Some(0), ..Self::default() }
    }

    /// Messages received in order.
    pub fn received(&self) -> u64 {
        self.received
    }

    /// Messages known to be lost.
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// The sequence number expected next; `None` before the first message.
    pub fn expected(&self) -> Option<u64> {
        self.next
    }
}

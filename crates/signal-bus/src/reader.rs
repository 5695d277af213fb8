//! Receiving: every message is checked, losses are counted.

use crate::Service;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;
use signals::{Arrival, Defect, Expectation, Message, SequenceTracker, check};

/// Every valid message of a service, in order.
pub struct StreamReader<B: Service> {
    subscriber: Subscriber<ipc::Service, Message<B>, ()>,
    expected: Expectation,
    sequence: SequenceTracker,
    refused: u64,
    last_defect: Option<Defect>,
}

impl<B: Service> StreamReader<B> {
    pub(crate) fn new(subscriber: Subscriber<ipc::Service, Message<B>, ()>, expected: Expectation) -> Self {
        Self { subscriber, expected, sequence: SequenceTracker::default(), refused: 0, last_defect: None }
    }

    /// The next valid message, with the number of messages that were lost before it; `None` when there is none now.
    /// Never waits. Messages that fail the check, and repeated or old ones, are passed over and counted.
    pub fn receive(&mut self) -> Option<(Message<B>, u64)> {
        while let Ok(Some(sample)) = self.subscriber.receive() {
            let message = *sample;
            if let Err(defect) = check(&message, &self.expected) {
                self.refused += 1;
                self.last_defect = Some(defect);
                continue;
            }
            match self.sequence.note(message.header.sequence) {
                Arrival::Next => return Some((message, 0)),
                Arrival::Gap(lost) => return Some((message, lost)),
                Arrival::Repeated | Arrival::Old => self.refused += 1,
            }
        }
        None
    }

    /// Counts losses from the publisher's first message on: for a reader that was there before it.
    pub fn expect_from_start(&mut self) {
        self.sequence = SequenceTracker::from_start();
    }

    /// Messages lost or refused.
    pub fn missed(&self) -> u64 {
        // A refused message also leaves a gap in the sequence unless it is the last so far: count the larger.
        self.sequence.missed().max(self.refused)
    }

    /// Messages received in order.
    pub fn received(&self) -> u64 {
        self.sequence.received()
    }

    /// What was wrong with the message refused last.
    pub fn last_defect(&self) -> Option<Defect> {
        self.last_defect
    }
}

/// The message of one's cycle.
pub struct CycleReader<B: Service> {
    stream: StreamReader<B>,
    // Came early: it belongs to a later cycle than the one asked for.
    early: Option<Message<B>>,
    newest: Option<Message<B>>,
}

impl<B: Service> CycleReader<B> {
    pub(crate) fn new(stream: StreamReader<B>) -> Self {
        Self { stream, early: None, newest: None }
    }

    /// The message of `cycle`; `None` if it is not there (yet). Those of earlier cycles are passed over, one of a
    /// later cycle is kept. Never waits.
    pub fn of_cycle(&mut self, cycle: u64) -> Option<B> {
        loop {
            let message = self.early.take().or_else(|| self.stream.receive().map(|(message, _)| message))?;
            self.newest = Some(message);
            if message.header.cycle == cycle {
                return Some(message.body);
            }
            if message.header.cycle > cycle {
                self.early = Some(message);
                return None;
            }
        }
    }

    /// The newest message so far, whatever its cycle; `None` before the first.
    pub fn latest(&mut self) -> Option<Message<B>> {
        while let Some((message, _)) = self.stream.receive() {
            self.newest = Some(message);
        }
        self.newest
    }

    /// The next message in order, whatever its cycle: for orders, which are carried out one by one.
    pub fn in_order(&mut self) -> Option<B> {
        self.stream.receive().map(|(message, _)| message.body)
    }

    /// Messages lost or refused.
    pub fn missed(&self) -> u64 {
        self.stream.missed()
    }
}

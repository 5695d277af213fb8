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
        loop {
            match self.next()? {
                Incoming::Message(message, lost) => return Some((message, lost)),
                Incoming::Absence(_) => {}
            }
        }
    }

    fn next(&mut self) -> Option<Incoming<B>> {
        while let Ok(Some(sample)) = self.subscriber.receive() {
            let message = *sample;
            match check(&message, &self.expected) {
                Ok(()) => {}
                Err(Defect::Absent { cycle }) => return Some(Incoming::Absence(cycle)),
                Err(defect) => {
                    self.refused += 1;
                    self.last_defect = Some(defect);
                    // The header is the publisher's own: this was its word on that cycle, and no other will come.
                    if matches!(defect, Defect::OutOfRange { .. }) {
                        return Some(Incoming::Absence(message.header.cycle));
                    }
                    continue;
                }
            }
            match self.sequence.note(message.header.sequence) {
                Arrival::Next => return Some(Incoming::Message(message, 0)),
                Arrival::Gap(lost) => return Some(Incoming::Message(message, lost)),
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

/// What came over a service.
enum Incoming<B: Service> {
    /// A message, and how many were lost before it.
    Message(Message<B>, u64),
    /// The publisher has none for this cycle that can be used.
    Absence(u64),
}

/// What there is for a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Found<B> {
    /// Its message.
    Message(B),
    /// None will come: the publisher said so (in lockstep alone), or sent one with a value outside its rules.
    Absence,
    /// Nothing yet.
    NotYet,
}

impl<B> Found<B> {
    /// The message, where there is one.
    pub fn message(self) -> Option<B> {
        match self {
            Self::Message(message) => Some(message),
            Self::Absence | Self::NotYet => None,
        }
    }
}

/// The message of one's cycle.
pub struct CycleReader<B: Service> {
    stream: StreamReader<B>,
    // Came early: it belongs to a later cycle than the one asked for.
    early: Option<Message<B>>,
    early_absence: Option<u64>,
    newest: Option<Message<B>>,
}

impl<B: Service> CycleReader<B> {
    pub(crate) fn new(stream: StreamReader<B>) -> Self {
        Self { stream, early: None, early_absence: None, newest: None }
    }

    /// The message of `cycle`, if it is there. Those of earlier cycles are passed over, one of a later cycle is kept.
    /// Never waits.
    pub fn of_cycle(&mut self, cycle: u64) -> Found<B> {
        self.take_in(cycle);
        if self.early_absence.take_if(|absent| *absent == cycle).is_some() {
            return Found::Absence;
        }
        let Some(message) = self.early.take_if(|message| message.header.cycle == cycle) else {
            return Found::NotYet;
        };
        self.newest = Some(message);
        Found::Message(message.body)
    }

    /// Takes in what there is already, up to the first of `cycle` or of a later one; what is of earlier cycles is passed over.
    /// [`Self::of_cycle`] then finds it at hand.
    pub fn take_in(&mut self, cycle: u64) {
        loop {
            if let Some(old) = self.early.take_if(|message| message.header.cycle < cycle) {
                self.newest = Some(old);
            }
            self.early_absence.take_if(|absent| *absent < cycle);
            if self.early.is_some() || self.early_absence.is_some() {
                return;
            }
            match self.stream.next() {
                Some(Incoming::Message(message, _)) => self.early = Some(message),
                Some(Incoming::Absence(absent)) => self.early_absence = Some(absent),
                None => return,
            }
        }
    }

    /// Looks whether there is a message and leaves it there: what tells so lies in this core's caches then.
    pub fn touch(&self) {
        // Whether there is one is the next reader's business.
        let _ = self.stream.subscriber.has_samples();
    }

    /// What was taken in for `cycle`.
    pub fn at_hand(&self, cycle: u64) -> Option<&B> {
        self.early.as_ref().filter(|message| message.header.cycle == cycle).map(|message| &message.body)
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

    /// What was wrong with the message refused last.
    pub fn last_defect(&self) -> Option<Defect> {
        self.stream.last_defect()
    }
}

//! The wire of the loop in one thread with faults in it: every message is sealed, carried, and checked as between
//! processes.

use crate::fault::{Fault, Injection};
use crate::line::Line;
use closed_loop::{Parts, Presence, Wire};
use signals::{
    Arrival, Body, ControlStatus, Expectation, Feedback, Header, Message, Reference, SequenceTracker, Source,
    StepCommand, check,
};

/// One publisher's messages of one kind, from it to their readers.
#[derive(Debug, Clone)]
struct Link<B: Body> {
    source: Source,
    sequence: u64,
    line: Line<B>,
    tracker: SequenceTracker,
    refused: u64,
}

impl<B: Body> Link<B> {
    fn new(source: Source, counts_per_turn: Option<f64>) -> Self {
        let (line, tracker) = (Line::new(counts_per_turn), SequenceTracker::default());
        Self { source, sequence: 0, line, tracker, refused: 0 }
    }

    /// What arrives of the message for `of_cycle` that is sent in `cycle`.
    fn carry(&mut self, cycle: u64, of_cycle: u64, time_ns: u64, body: B) -> Option<B> {
        let header = Header::new::<B>(self.source, 0, self.sequence, of_cycle, time_ns);
        self.sequence += 1;
        let carried = self.line.carry(cycle, Message::seal(header, body));
        let expected = Expectation { source: self.source, generation: 0 };
        let mut arrived = None;
        for message in carried.messages.into_iter().flatten() {
            if check(&message, &expected).is_err() {
                self.refused += 1;
                continue;
            }
            match self.tracker.note(message.header.sequence) {
                Arrival::Next | Arrival::Gap(_) if message.header.cycle == of_cycle => {
                    arrived = Some(message.body);
                }
                Arrival::Next | Arrival::Gap(_) => {}
                Arrival::Repeated | Arrival::Old => self.refused += 1,
            }
        }
        arrived
    }
}

/// A wire with faults in it.
#[derive(Debug, Clone)]
pub struct FaultyWire {
    period_ns: u64,
    feedback: Link<Feedback>,
    reference: Link<Reference>,
    command: Link<StepCommand>,
    status: Link<ControlStatus>,
    processes: Vec<Injection>,
}

impl FaultyWire {
    /// A wire of this loop, with these faults.
    pub fn new(parts: &Parts, injections: &[Injection]) -> Self {
        let counts = parts.plant.encoder.as_ref().map(|encoder| encoder.counts_per_turn);
        let mut wire = Self {
            period_ns: parts.timeline.period_ns,
            feedback: Link::new(Source::Plant, counts),
            reference: Link::new(Source::Trajectory, counts),
            command: Link::new(Source::Controller, counts),
            status: Link::new(Source::Controller, counts),
            processes: injections.to_vec(),
        };
        for injection in injections {
            wire.feedback.line.add(injection);
            wire.reference.line.add(injection);
            wire.command.line.add(injection);
            wire.status.line.add(injection);
        }
        wire
    }

    /// Messages that arrived and were refused.
    pub fn refused(&self) -> u64 {
        self.feedback.refused + self.reference.refused + self.command.refused + self.status.refused
    }
}

impl Wire for FaultyWire {
    fn presence(&self, source: Source, cycle: u64) -> Presence {
        for injection in &self.processes {
            match injection.fault {
                Fault::Silence { process } if process == source && cycle >= injection.at => {
                    return Presence::Silent;
                }
                Fault::Overrun { process, cycles }
                    if process == source && (injection.at..injection.at + cycles).contains(&cycle) =>
                {
                    return Presence::PassedOver;
                }
                _ => {}
            }
        }
        Presence::Runs
    }

    fn feedback(&mut self, cycle: u64, body: Feedback) -> Option<Feedback> {
        self.feedback.carry(cycle, cycle, cycle * self.period_ns, body)
    }

    fn reference(&mut self, cycle: u64, body: Reference) -> Option<Reference> {
        self.reference.carry(cycle, cycle + 2, cycle * self.period_ns, body)
    }

    fn command(&mut self, cycle: u64, body: StepCommand) -> Option<StepCommand> {
        self.command.carry(cycle, cycle + 1, cycle * self.period_ns, body)
    }

    fn status(&mut self, cycle: u64, body: ControlStatus) -> Option<ControlStatus> {
        self.status.carry(cycle, cycle, cycle * self.period_ns, body)
    }
}

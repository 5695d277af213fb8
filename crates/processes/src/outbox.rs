//! A service's messages on their way out: straight to the bus, or through a line of faults where injection is allowed.

use crate::child::Child;
use crate::part::Pace;
use crate::wishes::Wishes;
use injection::{Injection, Line};
use signal_bus::{BusError, Service, Writer};
use signals::{Message, Source};
use std::sync::Arc;

/// A writer through which faults can be injected.
pub(crate) struct Outbox<B: Service> {
    writer: Writer<B>,
    line: Option<Line<B>>,
    /// Where there is no clock: a reader without the message would wait for ever, so its absence is said, and one that can't be
    /// sent now is sent as soon as it can, unless the run is to end.
    without_clock: Option<Arc<Wishes>>,
}

impl<B: Service> Outbox<B> {
    pub(crate) fn open(child: &Child, source: Source) -> Result<Self, BusError> {
        Ok(Self {
            writer: child.bus.writer(source)?,
            line: child.injections.as_ref().map(|_| Line::new(None)),
            without_clock: (child.pace == Pace::Lockstep).then(|| Arc::clone(&child.wishes)),
        })
    }

    /// The same beside an encoder of so many counts per turn, which faults can befall.
    pub(crate) fn with_encoder(mut self, counts_per_turn: Option<f64>) -> Self {
        self.line = self.line.map(|_| Line::new(counts_per_turn));
        self
    }

    /// Awake before the cycle: has the next message's memory at hand.
    pub(crate) fn make_ready(&mut self) {
        self.writer.make_ready();
    }

    /// Publishes the message for `of_cycle` that this process makes in `cycle`. Never waits where there is a clock.
    pub(crate) fn write(&mut self, cycle: u64, of_cycle: u64, time_ns: u64, body: B) {
        let message = self.writer.seal(of_cycle, time_ns, body);
        let Some(line) = &mut self.line else { return self.send(message) };
        let carried = line.carry(cycle, message);
        for message in carried.messages.into_iter().flatten() {
            self.send(message);
        }
        if self.without_clock.is_some() && !carried.arrives {
            self.send(Message::absent(message.header));
        }
    }

    fn send(&mut self, message: Message<B>) {
        let Some(wishes) = &self.without_clock else { return self.writer.send(message) };
        while !self.writer.try_send(message) && !wishes.stop() {
            std::thread::yield_now();
        }
    }

    /// Says that there is no message for `of_cycle`, where there is no clock to tell by.
    pub(crate) fn pass_over(&mut self, of_cycle: u64, time_ns: u64) {
        if self.without_clock.is_some() {
            let message = self.writer.seal(of_cycle, time_ns, B::default());
            self.send(Message::absent(message.header));
        }
    }

    /// Lets a fault befall its messages from now on.
    pub(crate) fn inject(&mut self, injection: &Injection) {
        if let Some(line) = &mut self.line {
            line.add(injection);
        }
    }

    pub(crate) fn connect(&self) {
        self.writer.connect();
    }

    pub(crate) fn published(&self) -> u64 {
        self.writer.published()
    }

    pub(crate) fn failures(&self) -> u64 {
        self.writer.failures()
    }
}

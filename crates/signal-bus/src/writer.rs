//! Publishing: header, seal, and a send that never waits.

use crate::Service;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::ipc;
use iceoryx2::sample_mut_uninit::SampleMutUninit;
use signals::{Header, Message, Source};
use std::mem::MaybeUninit;

/// The one publisher of a service.
pub struct Writer<B: Service> {
    publisher: Publisher<ipc::Service, Message<B>, ()>,
    source: Source,
    generation: u64,
    next_sequence: u64,
    failures: u64,
    /// Memory for the next message, borrowed ahead of time.
    borrowed: Option<SampleMutUninit<ipc::Service, MaybeUninit<Message<B>>, ()>>,
}

impl<B: Service> Writer<B> {
    pub(crate) fn new(
        publisher: Publisher<ipc::Service, Message<B>, ()>,
        source: Source,
        generation: u64,
    ) -> Self {
        Self { publisher, source, generation, next_sequence: 0, failures: 0, borrowed: None }
    }

    /// Maps the readers that are there, so that the first cycles need not.
    pub fn connect(&self) {
        // One that can't be mapped in time is not tried again until the list of readers changes: its gap is declared.
        let _ = self.publisher.update_connections();
    }

    /// Publishes `body` as the message of `cycle`, stamped with the time `monotonic_ns`. Never waits. A message
    /// that can't be sent uses up its sequence number all the same, so that readers count it as lost.
    pub fn write(&mut self, cycle: u64, monotonic_ns: u64, body: B) {
        let message = self.seal(cycle, monotonic_ns, body);
        self.send(message);
    }

    /// The next message, sealed and counted as published, for [`Self::send`].
    pub fn seal(&mut self, cycle: u64, monotonic_ns: u64, body: B) -> Message<B> {
        let header = Header::new::<B>(self.source, self.generation, self.next_sequence, cycle, monotonic_ns);
        self.next_sequence += 1;
        Message::seal(header, body)
    }

    /// Borrows the memory of the next message ahead of time and writes to it, so that it lies in this core's caches when the message
    /// is sent.
    pub fn make_ready(&mut self) {
        if self.borrowed.is_none() {
            self.borrowed = self.publisher.loan_uninit().ok();
        }
        if let Some(sample) = &mut self.borrowed {
            sample.payload_mut().write(Message::default());
        }
    }

    /// Sends a message as it is, or counts it as failed. Never waits.
    pub fn send(&mut self, message: Message<B>) {
        if !self.try_send(message) {
            self.failures += 1;
        }
    }

    /// Sends a message as it is; false where that could not be done, and nothing is counted. Never waits.
    pub fn try_send(&mut self, message: Message<B>) -> bool {
        let sample = self.borrowed.take().map_or_else(|| self.publisher.loan_uninit(), Ok);
        let sent = sample.map(|sample| sample.write_payload(message).send());
        matches!(sent, Ok(Ok(_)))
    }

    /// Messages published, those that could not be sent included.
    pub fn published(&self) -> u64 {
        self.next_sequence
    }

    /// Messages that could not be sent.
    pub fn failures(&self) -> u64 {
        self.failures
    }
}

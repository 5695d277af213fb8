//! What waits to be sent to one client: bounded, so that a client that stops reading costs nobody else anything.

use rustix::fd::AsFd;
use serde_json::json;
use std::collections::VecDeque;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tungstenite::Message;

/// Samples that may wait for one client: the past of 20 signals over half a minute, or more than a minute of ten live ones.
const MOST_BYTES: usize = 16 << 20;
/// Answers beyond these are not waited for: who sends requests and reads nothing is no client.
const MOST_MESSAGES: usize = 20_000;

/// The queue of a client, and a bell for its thread.
pub(crate) struct Mailbox {
    waiting: Mutex<Waiting>,
    ring: UnixStream,
    bell: UnixStream,
}

#[derive(Default)]
struct Waiting {
    messages: VecDeque<Message>,
    bytes: usize,
    /// Rows that were not put here since the queue was full.
    dropped: u64,
}

impl Mailbox {
    /// An empty one.
    ///
    /// # Errors
    /// Where the system has no more descriptors.
    pub(crate) fn new() -> std::io::Result<Self> {
        let (ring, bell) = UnixStream::pair()?;
        ring.set_nonblocking(true)?;
        bell.set_nonblocking(true)?;
        Ok(Self { waiting: Mutex::default(), ring, bell })
    }

    /// Readable when something was put here.
    pub(crate) fn bell(&self) -> impl AsFd {
        &self.bell
    }

    /// Puts text here.
    pub(crate) fn tell(&self, text: &serde_json::Value) {
        let mut waiting = self.lock();
        if waiting.messages.len() < MOST_MESSAGES {
            waiting.messages.push_back(Message::text(text.to_string()));
        }
        drop(waiting);
        self.strike();
    }

    /// Puts samples here, `rows` of them, unless too much waits already: then they are counted, and the client is told.
    pub(crate) fn send(&self, samples: Vec<u8>, rows: u64) {
        let mut waiting = self.lock();
        if waiting.bytes + samples.len() > MOST_BYTES {
            waiting.dropped += rows;
            return;
        }
        if waiting.dropped > 0 {
            let told = json!({ "is": "dropped", "rows": waiting.dropped });
            waiting.messages.push_back(Message::text(told.to_string()));
            waiting.dropped = 0;
        }
        waiting.bytes += samples.len();
        waiting.messages.push_back(Message::binary(samples));
        drop(waiting);
        self.strike();
    }

    /// The next message.
    pub(crate) fn next(&self) -> Option<Message> {
        let mut waiting = self.lock();
        let message = waiting.messages.pop_front()?;
        if let Message::Binary(samples) = &message {
            waiting.bytes -= samples.len();
        }
        Some(message)
    }

    /// Silences the bell: what rang it is looked at now.
    pub(crate) fn heard(&self) {
        let mut scratch = [0; 64];
        while (&self.bell).read(&mut scratch).is_ok_and(|count| count == scratch.len()) {}
    }

    fn strike(&self) {
        // A full pipe rings already.
        let _ = (&self.ring).write(&[1]);
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_client_that_does_not_read_is_told_what_it_missed() {
        let mailbox = Mailbox::new().unwrap();
        let piece = 1 << 20;
        (0..20).for_each(|_| mailbox.send(vec![0; piece], 10));
        let held = MOST_BYTES / piece;
        (0..held).for_each(|_| assert!(matches!(mailbox.next(), Some(Message::Binary(_)))));
        assert_eq!(mailbox.next(), None);
        mailbox.send(vec![0; 8], 1);
        let told = mailbox.next().unwrap().into_text().unwrap();
        assert_eq!(told.as_str(), format!(r#"{{"is":"dropped","rows":{}}}"#, (20 - held) * 10));
        assert!(matches!(mailbox.next(), Some(Message::Binary(_))));
    }
}

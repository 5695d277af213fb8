//! Messages as their bytes, one behind the other, in the order in which they came.

use recording::Topic;

/// Where one message lies.
#[derive(Debug, Clone, Copy)]
struct Entry {
    topic: Topic,
    /// The cycle that it speaks of.
    cycle: u64,
    begin: usize,
    end: usize,
}

/// A message in a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stored<'a> {
    pub(crate) topic: Topic,
    pub(crate) cycle: u64,
    pub(crate) bytes: &'a [u8],
}

impl Stored<'_> {
    /// When it was published, on the loop's clock.
    pub(crate) fn published_ns(&self) -> u64 {
        let word =
            |index: usize| self.bytes.as_chunks::<8>().0.get(index).map(|word| u64::from_le_bytes(*word));
        word(PUBLISHED).unwrap_or(0)
    }
}

/// Which word of a header is its time.
const PUBLISHED: usize = 5;

/// Messages and their bytes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Block {
    entries: Vec<Entry>,
    bytes: Vec<u8>,
}

impl Block {
    /// An empty one that holds so much before it grows.
    pub(crate) fn with_room(bytes: usize, messages: usize) -> Self {
        Self { entries: Vec::with_capacity(messages), bytes: Vec::with_capacity(bytes) }
    }

    /// Bytes that it holds before it grows.
    #[cfg(test)]
    pub(crate) fn room(&self) -> usize {
        self.bytes.capacity()
    }

    /// Adds a message; `append` puts its bytes behind the others.
    pub(crate) fn push(&mut self, topic: Topic, cycle: u64, append: impl FnOnce(&mut Vec<u8>)) {
        let begin = self.bytes.len();
        append(&mut self.bytes);
        self.entries.push(Entry { topic, cycle, begin, end: self.bytes.len() });
    }

    /// All messages, in their order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = Stored<'_>> {
        self.entries.iter().map(|entry| Stored {
            topic: entry.topic,
            cycle: entry.cycle,
            bytes: self.bytes.get(entry.begin..entry.end).unwrap_or(&[]),
        })
    }

    /// The bytes of all messages.
    pub(crate) fn len(&self) -> usize {
        self.bytes.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Empties it and keeps its memory.
    pub(crate) fn clear(&mut self) {
        self.entries.clear();
        self.bytes.clear();
    }
}

/// Whether a topic's messages speak of a cycle; the supervisor's do not.
pub(crate) fn has_cycle(topic: Topic) -> bool {
    !matches!(topic, Topic::SetPoint | Topic::OperatorCommand)
}

//! The header that every message begins with.

use crate::Source;
use crate::body::Body;
use crate::field::{Field, Kind, Rule};
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

/// Who sent a message, when, in which cycle, and what its body should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend)]
#[repr(C)]
pub struct Header {
    /// [`Body::SCHEMA_HASH`] of the message's body as the sender was compiled.
    pub schema_hash: u64,
    /// The sender, a [`Source`].
    pub source: u64,
    /// The start of the instance that the sender belongs to: counted by the supervisor, 0 in lockstep.
    pub generation: u64,
    /// Counts the publisher's messages of this kind from 0; a jump tells of lost ones.
    pub sequence: u64,
    /// The cycle that the body speaks of: Reference n, StepCommand n, Feedback n.
    pub cycle: u64,
    /// CLOCK_MONOTONIC when it was sent, in ns; in lockstep and in process cycle times period.
    pub monotonic_ns: u64,
    /// CRC-32C of all other words of the message, little-endian, header first; in the low 32 bits.
    pub crc: u64,
}

impl Header {
    /// The header's fields in the order of their bytes.
    pub const FIELDS: &'static [Field] = &[
        word("schema_hash", "1"),
        word("source", "1"),
        word("generation", "1"),
        word("sequence", "1"),
        word("cycle", "1"),
        word("monotonic_ns", "ns"),
        word("crc", "1"),
    ];

    /// A header for a body of type `B`; the CRC is still to be set by [`crate::Message::seal`].
    pub fn new<B: Body>(
        source: Source,
        generation: u64,
        sequence: u64,
        cycle: u64,
        monotonic_ns: u64,
    ) -> Self {
        Self {
            schema_hash: B::SCHEMA_HASH,
            source: source.code(),
            generation,
            sequence,
            cycle,
            monotonic_ns,
            crc: 0,
        }
    }

    /// The bits of each field but the CRC, little-endian, in order.
    #[inline]
    pub(crate) fn protected_words(&self) -> [[u8; 8]; 6] {
        let words =
            [self.schema_hash, self.source, self.generation, self.sequence, self.cycle, self.monotonic_ns];
        words.map(u64::to_le_bytes)
    }

    /// Hands each field's bits to `take`, in order.
    pub fn each_word(&self, mut take: impl FnMut(u64)) {
        self.protected_words().iter().for_each(|word| take(u64::from_le_bytes(*word)));
        take(self.crc);
    }

    /// A header from the bits of its fields, in order; missing ones count as zero.
    pub fn from_words(words: &mut impl Iterator<Item = u64>) -> Self {
        let mut next = || words.next().unwrap_or(0);
        Self {
            schema_hash: next(),
            source: next(),
            generation: next(),
            sequence: next(),
            cycle: next(),
            monotonic_ns: next(),
            crc: next(),
        }
    }
}

const fn word(name: &'static str, unit: &'static str) -> Field {
    Field { name, kind: Kind::U64, unit, rule: Rule::Any }
}

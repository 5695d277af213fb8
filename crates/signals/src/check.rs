//! The one check of a received message, and the seal that it verifies.

use crate::Source;
use crate::body::Body;
use crate::field::Rule;
use crate::header::Header;
use crate::message::Message;
use thiserror::Error;

/// What is wrong with a received message. `Copy`, so that the loop can report it without heap.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum Defect {
    /// The sender was compiled with another layout, or this is another message.
    #[error("schema hash {found:#018x}, expected {expected:#018x}")]
    WrongSchema {
        /// The hash in the header.
        found: u64,
        /// The hash of the message expected.
        expected: u64,
    },
    /// No message at all: the sender of a lockstep run says that it has none for this cycle.
    #[error("the sender has no message for cycle {cycle}")]
    Absent {
        /// The cycle.
        cycle: u64,
    },
    /// Bits differ from what was sent.
    #[error("CRC {found:#010x}, expected {expected:#010x}")]
    WrongCrc {
        /// The CRC in the header.
        found: u64,
        /// The CRC of what was received.
        expected: u64,
    },
    /// Somebody else publishes on the service.
    #[error("source {found}, expected {expected}")]
    WrongSource {
        /// The source in the header.
        found: u64,
        /// The source that owns the service.
        expected: u64,
    },
    /// A message of an earlier or another start of the instance.
    #[error("generation {found}, expected {expected}")]
    WrongGeneration {
        /// The generation in the header.
        found: u64,
        /// The reader's own.
        expected: u64,
    },
    /// A field is NaN, infinite, or outside its range.
    #[error("{field} is {found}, expected {expected:?}")]
    OutOfRange {
        /// The field's name.
        field: &'static str,
        /// Its value; counts and codes are rounded to `f64`.
        found: f64,
        /// The rule that it breaks.
        expected: Rule,
    },
}

/// What a reader expects of every message of a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Expectation {
    /// The process that owns the service.
    pub source: Source,
    /// The reader's generation.
    pub generation: u64,
}

/// Stands in the schema hash's place of a message that says that there is none: no message has it.
const ABSENT: u64 = 0;

/// Checks a received message: layout, bits, sender, generation, and each field's range, in this order.
///
/// # Errors
/// The first [`Defect`] found. A message with one must not be used, and counts as missing.
pub fn check<B: Body>(message: &Message<B>, expected: &Expectation) -> Result<(), Defect> {
    let header = &message.header;
    if header.schema_hash != B::SCHEMA_HASH && header.schema_hash != ABSENT {
        return Err(Defect::WrongSchema { found: header.schema_hash, expected: B::SCHEMA_HASH });
    }
    let crc = message.crc();
    if header.crc != crc {
        return Err(Defect::WrongCrc { found: header.crc, expected: crc });
    }
    if header.source != expected.source.code() {
        return Err(Defect::WrongSource { found: header.source, expected: expected.source.code() });
    }
    if header.generation != expected.generation {
        return Err(Defect::WrongGeneration { found: header.generation, expected: expected.generation });
    }
    if header.schema_hash == ABSENT {
        return Err(Defect::Absent { cycle: header.cycle });
    }
    check_fields(&message.body)
}

fn check_fields<B: Body>(body: &B) -> Result<(), Defect> {
    if body.is_within_rules() { Ok(()) } else { name_broken_rule(body) }
}

#[cold]
fn name_broken_rule<B: Body>(body: &B) -> Result<(), Defect> {
    let mut result = Ok(());
    let mut fields = B::FIELDS.iter();
    body.each_word(|word| {
        if let (Ok(()), Some(field)) = (result, fields.next())
            && !field.rule.holds(field.kind, word)
        {
            let found = field.kind.value(word);
            result = Err(Defect::OutOfRange { field: field.name, found, expected: field.rule });
        }
    });
    result
}

impl<B: Body> Message<B> {
    /// A sealed message: header and body with the CRC over both.
    pub fn seal(header: Header, body: B) -> Self {
        let mut message = Self { header, body };
        message.header.crc = message.crc();
        message
    }

    /// Says that there is no message in the place of the one that `header` belongs to. In lockstep there is no clock to
    /// tell a silent partner by, so silence has to be said.
    pub fn absent(header: Header) -> Self {
        Self::seal(Header { schema_hash: ABSENT, ..header }, B::default())
    }

    /// CRC-32C of all words but the CRC itself, little-endian, header first.
    fn crc(&self) -> u64 {
        let header = crc32c::crc32c(self.header.protected_words().as_flattened());
        u64::from(crc32c::crc32c_append(header, self.body.words().as_ref().as_flattened()))
    }
}

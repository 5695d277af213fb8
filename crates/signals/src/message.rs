//! What a message is: a header and a body whose fields are all eight bytes, described by a table.

use crate::header::Header;
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

/// Largest angle that a message may carry, in rad: 1e9 turns of 2π, far beyond a life of rotation.
pub const MAX_ANGLE_RAD: f64 = 6.3e9;

/// Largest micro-step count that a message may carry: every such count is exact as `f64`.
pub const MAX_MICROSTEPS: f64 = 9_007_199_254_740_992.0;

/// How a field's eight bytes are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// An unsigned count, code or set of flags.
    U64,
    /// A signed count.
    I64,
    /// A physical quantity.
    F64,
}

impl Kind {
    /// A field's eight bytes as a number; counts and codes are rounded to `f64`.
    #[inline]
    pub(crate) fn value(self, word: u64) -> f64 {
        match self {
            Self::U64 => word as f64,
            Self::I64 => word.cast_signed() as f64,
            Self::F64 => f64::from_bits(word),
        }
    }
}

/// What a field's value must fulfil to be accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// Any bit pattern of the kind.
    Any,
    /// A number from the first to the second, both included; never NaN. Signed counts are compared as numbers.
    Within(f64, f64),
    /// A code or a set of flags below this.
    Below(u64),
}

impl Rule {
    /// Whether a field's eight bytes fulfil it.
    #[inline]
    pub(crate) fn holds(self, kind: Kind, word: u64) -> bool {
        match self {
            Self::Any => true,
            // A comparison with NaN is false, so NaN is refused here too.
            Self::Within(low, high) => {
                let value = kind.value(word);
                (low <= value) & (value <= high)
            }
            Self::Below(limit) => word < limit,
        }
    }
}

/// One field of a message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// Its name; dimensional ones end in the unit.
    pub name: &'static str,
    /// How its eight bytes are read.
    pub kind: Kind,
    /// Its unit as run files write it; "1" for counts, codes and flags.
    pub unit: &'static str,
    /// What its value must fulfil.
    pub rule: Rule,
}

/// A message's body: plain data of eight-byte fields with a table that describes them.
pub trait Body:
    ZeroCopySend + Copy + Clone + core::fmt::Debug + Default + PartialEq + Send + Sync + 'static
{
    /// Its name, e.g. `Feedback`.
    const NAME: &'static str;
    /// The last part of its service's name, e.g. `feedback`.
    const TOPIC: &'static str;
    /// The fields in the order of their bytes.
    const FIELDS: &'static [Field];
    /// FNV-1a over the name, and each field's name, kind and unit, header included: two programs that disagree
    /// about the layout refuse each other's messages.
    const SCHEMA_HASH: u64;

    /// Each field's bits in little-endian order, in the order of the fields.
    fn words(&self) -> impl AsRef<[[u8; 8]]>;

    /// Hands each field's bits to `take`, in order.
    fn each_word(&self, mut take: impl FnMut(u64)) {
        self.words().as_ref().iter().for_each(|word| take(u64::from_le_bytes(*word)));
    }

    /// Whether every field fulfils its rule.
    fn is_within_rules(&self) -> bool;

    /// Puts a body together from the bits of its fields, in order; missing ones count as zero.
    fn from_words(words: impl Iterator<Item = u64>) -> Self;
}

/// A body with its header, as it lies in shared memory and in a record.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[repr(C)]
pub struct Message<B: Body> {
    /// Who sent it, when, and what it should be.
    pub header: Header,
    /// What it says.
    pub body: B,
}

impl<B: Body> Message<B> {
    /// The number of eight-byte words of header and body.
    pub const WORDS: usize = Header::FIELDS.len() + B::FIELDS.len();

    /// The message's bytes as a record keeps them (little-endian words), appended to `out`.
    pub fn append_bytes(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(self.header.protected_words().as_flattened());
        out.extend_from_slice(&self.header.crc.to_le_bytes());
        out.extend_from_slice(self.body.words().as_ref().as_flattened());
    }

    /// A message from such bytes; `None` unless there are exactly as many as it has.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        if bytes.len() != Self::WORDS * 8 {
            return None;
        }
        let mut words = bytes.as_chunks::<8>().0.iter().map(|chunk| u64::from_le_bytes(*chunk));
        let header = Header::from_words(&mut words);
        Some(Self { header, body: B::from_words(words) })
    }
}

/// FNV-1a, continued from `hash` over `text`.
pub(crate) const fn fnv1a(mut hash: u64, text: &str) -> u64 {
    let bytes = text.as_bytes();
    let mut i = 0;
    while i < bytes.len() {
        #[expect(clippy::indexing_slicing, reason = "i < len; const code has no iterators")]
        let byte = bytes[i];
        hash = (hash ^ byte as u64).wrapping_mul(0x0000_0100_0000_01b3);
        i += 1;
    }
    hash
}

/// FNV-1a's offset basis.
pub(crate) const FNV_START: u64 = 0xcbf2_9ce4_8422_2325;

/// FNV-1a, continued over a table of fields.
pub(crate) const fn hash_fields(mut hash: u64, fields: &[Field]) -> u64 {
    let mut i = 0;
    while i < fields.len() {
        #[expect(clippy::indexing_slicing, reason = "i < len; const code has no iterators")]
        let field = &fields[i];
        hash = fnv1a(hash, field.name);
        hash = fnv1a(
            hash,
            match field.kind {
                Kind::U64 => ":u64:",
                Kind::I64 => ":i64:",
                Kind::F64 => ":f64:",
            },
        );
        hash = fnv1a(hash, field.unit);
        i += 1;
    }
    hash
}

/// A field's type seen as eight bytes.
pub(crate) trait Word: Copy {
    const KIND: Kind;
    fn to_word(self) -> u64;
    fn from_word(word: u64) -> Self;
}

impl Word for u64 {
    const KIND: Kind = Kind::U64;
    fn to_word(self) -> u64 {
        self
    }
    fn from_word(word: u64) -> Self {
        word
    }
}

impl Word for i64 {
    const KIND: Kind = Kind::I64;
    fn to_word(self) -> u64 {
        self.cast_unsigned()
    }
    fn from_word(word: u64) -> Self {
        word.cast_signed()
    }
}

impl Word for f64 {
    const KIND: Kind = Kind::F64;
    fn to_word(self) -> u64 {
        self.to_bits()
    }
    fn from_word(word: u64) -> Self {
        f64::from_bits(word)
    }
}

/// Declares a message body: the struct, its table of fields, and its conversion to words.
macro_rules! message {
    (
        $(#[$doc:meta])*
        $name:ident, $topic:literal {
            $( $(#[$field_doc:meta])* $field:ident : $kind:ty [$unit:literal, $rule:expr] ),* $(,)?
        }
    ) => {
        // The derive names this trait without a path.
        use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Default, iceoryx2_bb_derive_macros::ZeroCopySend)]
        #[repr(C)]
        pub struct $name {
            $( $(#[$field_doc])* pub $field: $kind ),*
        }

        impl $crate::message::Body for $name {
            const NAME: &'static str = stringify!($name);
            const TOPIC: &'static str = $topic;
            const FIELDS: &'static [$crate::message::Field] = {
                #[allow(unused_imports)]
                use $crate::message::{Field, Rule::*, Word, MAX_ANGLE_RAD, MAX_MICROSTEPS};
                &[ $( Field { name: stringify!($field), kind: <$kind as Word>::KIND, unit: $unit, rule: $rule } ),* ]
            };
            const SCHEMA_HASH: u64 = {
                use $crate::message::{fnv1a, hash_fields, FNV_START};
                hash_fields(hash_fields(fnv1a(FNV_START, stringify!($name)), $crate::Header::FIELDS), Self::FIELDS)
            };

            #[inline]
            fn words(&self) -> impl AsRef<[[u8; 8]]> {
                use $crate::message::Word;
                [$( self.$field.to_word().to_le_bytes() ),*]
            }

            #[inline]
            fn is_within_rules(&self) -> bool {
                #[allow(unused_imports)]
                use $crate::message::{Rule::*, Word, MAX_ANGLE_RAD, MAX_MICROSTEPS};
                // Every rule is looked at: without branches this is cheaper than to stop at the first one broken.
                let mut good = true;
                $( good &= { const RULE: $crate::Rule = $rule; RULE.holds(<$kind as Word>::KIND, self.$field.to_word()) }; )*
                good
            }

            fn from_words(mut words: impl Iterator<Item = u64>) -> Self {
                use $crate::message::Word;
                $( let $field = <$kind as Word>::from_word(words.next().unwrap_or(0)); )*
                Self { $($field),* }
            }
        }
    };
}

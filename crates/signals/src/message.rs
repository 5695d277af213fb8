//! A message: a header and a body. The macro that declares a body with its table of fields.

use crate::body::Body;
use crate::header::Header;
use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

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

        impl $crate::body::Body for $name {
            const NAME: &'static str = stringify!($name);
            const TOPIC: &'static str = $topic;
            const FIELDS: &'static [$crate::field::Field] = {
                #[allow(unused_imports)]
                use $crate::field::{Field, Rule::*, Word, MAX_ANGLE_RAD, MAX_MICROSTEPS};
                &[ $( Field { name: stringify!($field), kind: <$kind as Word>::KIND, unit: $unit, rule: $rule } ),* ]
            };
            const SCHEMA_HASH: u64 = {
                use $crate::field::{fnv1a, hash_fields, FNV_START};
                hash_fields(hash_fields(fnv1a(FNV_START, stringify!($name)), $crate::Header::FIELDS), Self::FIELDS)
            };

            #[inline]
            fn words(&self) -> impl AsRef<[[u8; 8]]> {
                use $crate::field::Word;
                [$( self.$field.to_word().to_le_bytes() ),*]
            }

            #[inline]
            fn is_within_rules(&self) -> bool {
                #[allow(unused_imports)]
                use $crate::field::{Rule::*, Word, MAX_ANGLE_RAD, MAX_MICROSTEPS};
                // Every rule is looked at: without branches this is cheaper than to stop at the first one broken.
                let mut good = true;
                $( good &= { const RULE: $crate::Rule = $rule; RULE.holds(<$kind as Word>::KIND, self.$field.to_word()) }; )*
                good
            }

            fn from_words(mut words: impl Iterator<Item = u64>) -> Self {
                use $crate::field::Word;
                $( let $field = <$kind as Word>::from_word(words.next().unwrap_or(0)); )*
                Self { $($field),* }
            }
        }
    };
}

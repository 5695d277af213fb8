//! One field of a message: how its eight bytes are read, what its value must fulfil, and the hash of a table of fields.

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
    pub fn value(self, word: u64) -> f64 {
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

    /// The eight bytes of the nearest number that fulfils it, zero's for one that is none; codes and flags stay as they are.
    pub(crate) fn nearest(self, kind: Kind, word: u64) -> u64 {
        let Self::Within(low, high) = self else { return word };
        if self.holds(kind, word) {
            return word;
        }
        let value = kind.value(word);
        let nearest = if value.is_nan() { 0.0_f64.clamp(low, high) } else { value.clamp(low, high) };
        match kind {
            Kind::U64 => nearest as u64,
            Kind::I64 => (nearest as i64).cast_unsigned(),
            Kind::F64 => nearest.to_bits(),
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

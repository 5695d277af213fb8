//! What every message's body is: plain data of eight-byte fields, described by a table.

use crate::field::Field;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

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

    /// The same with each number within its rule: what a reader would refuse becomes the nearest that it takes.
    #[must_use]
    fn clamped(&self) -> Self {
        if self.is_within_rules() {
            return *self;
        }
        let words = self.words();
        let fields = words.as_ref().iter().zip(Self::FIELDS);
        Self::from_words(
            fields.map(|(word, field)| field.rule.nearest(field.kind, u64::from_le_bytes(*word))),
        )
    }

    /// Puts a body together from the bits of its fields, in order; missing ones count as zero.
    fn from_words(words: impl Iterator<Item = u64>) -> Self;
}

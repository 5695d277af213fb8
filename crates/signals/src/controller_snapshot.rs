//! ControllerSnapshot: the controller's whole state, part by part, so that a record can be replayed from its middle.

message! {
    /// A part of the controller's state before a cycle: what `stepvalve replay` begins from where a record does not begin with
    /// the run. The bytes are in postcard's format and belong to the version of the program that wrote them.
    ControllerSnapshot, "controller-snapshot" {
        /// The cycle before which the state was taken.
        taken_before_cycle: u64 ["1", Any],
        /// Bytes of the whole state.
        bytes: u64 ["1", Below(1 << 20)],
        /// Which part this is: bytes from 256 times this on.
        part: u64 ["1", Below(1 << 12)],
        /// Bytes 0 to 7 of the part, little-endian.
        word_00: u64 ["1", Any],
        /// Bytes 8 to 15 of the part, little-endian.
        word_01: u64 ["1", Any],
        /// Bytes 16 to 23 of the part, little-endian.
        word_02: u64 ["1", Any],
        /// Bytes 24 to 31 of the part, little-endian.
        word_03: u64 ["1", Any],
        /// Bytes 32 to 39 of the part, little-endian.
        word_04: u64 ["1", Any],
        /// Bytes 40 to 47 of the part, little-endian.
        word_05: u64 ["1", Any],
        /// Bytes 48 to 55 of the part, little-endian.
        word_06: u64 ["1", Any],
        /// Bytes 56 to 63 of the part, little-endian.
        word_07: u64 ["1", Any],
        /// Bytes 64 to 71 of the part, little-endian.
        word_08: u64 ["1", Any],
        /// Bytes 72 to 79 of the part, little-endian.
        word_09: u64 ["1", Any],
        /// Bytes 80 to 87 of the part, little-endian.
        word_10: u64 ["1", Any],
        /// Bytes 88 to 95 of the part, little-endian.
        word_11: u64 ["1", Any],
        /// Bytes 96 to 103 of the part, little-endian.
        word_12: u64 ["1", Any],
        /// Bytes 104 to 111 of the part, little-endian.
        word_13: u64 ["1", Any],
        /// Bytes 112 to 119 of the part, little-endian.
        word_14: u64 ["1", Any],
        /// Bytes 120 to 127 of the part, little-endian.
        word_15: u64 ["1", Any],
        /// Bytes 128 to 135 of the part, little-endian.
        word_16: u64 ["1", Any],
        /// Bytes 136 to 143 of the part, little-endian.
        word_17: u64 ["1", Any],
        /// Bytes 144 to 151 of the part, little-endian.
        word_18: u64 ["1", Any],
        /// Bytes 152 to 159 of the part, little-endian.
        word_19: u64 ["1", Any],
        /// Bytes 160 to 167 of the part, little-endian.
        word_20: u64 ["1", Any],
        /// Bytes 168 to 175 of the part, little-endian.
        word_21: u64 ["1", Any],
        /// Bytes 176 to 183 of the part, little-endian.
        word_22: u64 ["1", Any],
        /// Bytes 184 to 191 of the part, little-endian.
        word_23: u64 ["1", Any],
        /// Bytes 192 to 199 of the part, little-endian.
        word_24: u64 ["1", Any],
        /// Bytes 200 to 207 of the part, little-endian.
        word_25: u64 ["1", Any],
        /// Bytes 208 to 215 of the part, little-endian.
        word_26: u64 ["1", Any],
        /// Bytes 216 to 223 of the part, little-endian.
        word_27: u64 ["1", Any],
        /// Bytes 224 to 231 of the part, little-endian.
        word_28: u64 ["1", Any],
        /// Bytes 232 to 239 of the part, little-endian.
        word_29: u64 ["1", Any],
        /// Bytes 240 to 247 of the part, little-endian.
        word_30: u64 ["1", Any],
        /// Bytes 248 to 255 of the part, little-endian.
        word_31: u64 ["1", Any],
    }
}

impl ControllerSnapshot {
    /// Bytes in a part.
    pub const PART_BYTES: usize = 256;

    /// A part that carries up to [`Self::PART_BYTES`] bytes.
    pub fn of(taken_before_cycle: u64, bytes: u64, part: u64, content: &[u8]) -> Self {
        let word = |index: usize| {
            let mut word = [0; 8];
            for (to, from) in word.iter_mut().zip(content.iter().skip(index * 8)) {
                *to = *from;
            }
            u64::from_le_bytes(word)
        };
        let head = [taken_before_cycle, bytes, part];
        <Self as crate::Body>::from_words(head.into_iter().chain((0..Self::PART_BYTES / 8).map(word)))
    }

    /// The bytes that it carries, and zeros behind the last.
    pub fn content(&self) -> [u8; Self::PART_BYTES] {
        let mut content = [0; Self::PART_BYTES];
        let mut places = content.as_chunks_mut::<8>().0.iter_mut();
        let mut index = 0;
        crate::Body::each_word(self, |word| {
            if index >= 3
                && let Some(place) = places.next()
            {
                *place = word.to_le_bytes();
            }
            index += 1;
        });
        content
    }
}

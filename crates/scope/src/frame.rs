//! Samples as the page takes them: little-endian, in columns, eight bytes a number.
//!
//! A message holds one frame behind the other:
//!
//! | bytes | what |
//! |---|---|
//! | 4 × u32 | purpose ([`Purpose`]), topic, rows, columns |
//! | f64 | the capture's id, or when the newest row was published, in µs of the loop's clock |
//! | u32 a column | which field; one of zeros where their number is odd |
//! | f64 a row | cycle |
//! | f64 a row, column by column | values |

use crate::block::Stored;
use crate::signal::Field;
use recording::Topic;

/// What a frame's samples are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// What came just now.
    Live,
    /// The past of what is looked at from now on, in place of all that was sent before.
    Past,
    /// A capture.
    Capture,
}

/// Appends a frame.
pub(crate) fn append(
    out: &mut Vec<u8>,
    purpose: Purpose,
    number: f64,
    topic: Topic,
    rows: &[Stored<'_>],
    fields: &[Field],
) {
    let words = [purpose as u32, topic as u32, rows.len() as u32, fields.len() as u32];
    words.iter().for_each(|word| out.extend_from_slice(&word.to_le_bytes()));
    out.extend_from_slice(&number.to_le_bytes());
    for field in fields {
        out.extend_from_slice(&(field.index as u32).to_le_bytes());
    }
    if !fields.len().is_multiple_of(2) {
        out.extend_from_slice(&[0; 4]);
    }
    rows.iter().for_each(|row| out.extend_from_slice(&(row.cycle as f64).to_le_bytes()));
    for field in fields {
        rows.iter().for_each(|row| out.extend_from_slice(&field.value(row.bytes).to_le_bytes()));
    }
}

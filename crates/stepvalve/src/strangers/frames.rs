//! How a file's contents come through a pipe: heads in postcard behind their length, numbers as they are in memory.

use anyhow::{Context, bail, ensure};
use log_data::Attribute;
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};

/// No head is longer: texts of a log's attributes among it.
const MOST_HEAD_BYTES: usize = 16 << 20;
/// Numbers read at once.
const BLOCK: usize = 32 * 1024;

/// A part of what a file holds.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Head {
    /// What a log says beside its runs.
    Log { title: String, provenance: Option<String>, angle_zero: String, attributes: Vec<(String, Fact)> },
    /// A run begins; its columns follow.
    Run { name: String, kind: String, attributes: Vec<(String, Fact)> },
    /// A channel of the run; its numbers follow.
    Channel { name: String, numbers: u64 },
    /// An array; its numbers follow, the first index running fastest.
    Array { name: String, shape: Vec<u64>, numbers: u64 },
    /// All was sent.
    End,
}

/// An attribute.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Fact {
    Text(String),
    Number(f64),
}

impl From<Attribute> for Fact {
    fn from(attribute: Attribute) -> Self {
        match attribute {
            Attribute::Text(text) => Self::Text(text),
            Attribute::Number(number) => Self::Number(number),
        }
    }
}

impl From<Fact> for Attribute {
    fn from(fact: Fact) -> Self {
        match fact {
            Fact::Text(text) => Self::Text(text),
            Fact::Number(number) => Self::Number(number),
        }
    }
}

/// Sends a head.
pub(super) fn send(out: &mut impl Write, head: &Head) -> anyhow::Result<()> {
    let bytes = postcard::to_stdvec(head).context("a part's head")?;
    ensure!(
        bytes.len() <= MOST_HEAD_BYTES,
        "texts of {} bytes, expected at most {MOST_HEAD_BYTES}",
        bytes.len()
    );
    out.write_all(&(bytes.len() as u32).to_le_bytes())?;
    Ok(out.write_all(&bytes)?)
}

/// Sends numbers.
pub(super) fn send_numbers(out: &mut impl Write, numbers: &[f64]) -> anyhow::Result<()> {
    let mut bytes = Vec::with_capacity(8 * BLOCK.min(numbers.len()));
    for block in numbers.chunks(BLOCK) {
        bytes.clear();
        bytes.extend(block.iter().flat_map(|number| number.to_le_bytes()));
        out.write_all(&bytes)?;
    }
    Ok(())
}

/// Receives heads and numbers.
pub(super) struct Receiver<R> {
    input: R,
    /// So many numbers are still taken.
    left: usize,
    most: usize,
}

impl<R: Read> Receiver<R> {
    pub(super) fn new(input: R, most: usize) -> Self {
        Self { input, left: most, most }
    }

    pub(super) fn head(&mut self) -> anyhow::Result<Head> {
        let mut length = [0; 4];
        self.input.read_exact(&mut length)?;
        let length = u32::from_le_bytes(length) as usize;
        if length > MOST_HEAD_BYTES {
            bail!("a head of {length} bytes");
        }
        let mut bytes = vec![0; length];
        self.input.read_exact(&mut bytes)?;
        Ok(postcard::from_bytes(&bytes)?)
    }

    /// Numbers, in memory only as far as they have come.
    pub(super) fn numbers(&mut self, count: u64) -> anyhow::Result<Vec<f64>> {
        let count = usize::try_from(count).ok().filter(|count| *count <= self.left);
        let Some(count) = count else { bail!(TooMany { most: self.most }) };
        self.left -= count;
        let mut numbers = Vec::with_capacity(count.min(BLOCK));
        let mut bytes = vec![0; 8 * BLOCK.min(count)];
        while numbers.len() < count {
            let block = BLOCK.min(count - numbers.len());
            let Some(bytes) = bytes.get_mut(..8 * block) else { break };
            self.input.read_exact(bytes)?;
            let (words, _) = bytes.as_chunks();
            numbers.extend(words.iter().map(|word| f64::from_le_bytes(*word)));
        }
        Ok(numbers)
    }
}

/// A file holds more than is taken.
#[derive(Debug, thiserror::Error)]
#[error("more than {most} numbers, expected no more from a file of this size")]
pub(super) struct TooMany {
    most: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sent_is_received_and_no_more_than_is_taken() {
        let numbers: Vec<f64> = (0..100_000).map(|k| f64::from(k).sqrt()).collect();
        let mut pipe = Vec::new();
        send(&mut pipe, &Head::Channel { name: "torque".to_owned(), numbers: 100_000 }).unwrap();
        send_numbers(&mut pipe, &numbers).unwrap();
        send(&mut pipe, &Head::End).unwrap();
        let mut receiver = Receiver::new(&pipe[..], 100_000);
        assert!(matches!(receiver.head().unwrap(), Head::Channel { numbers: 100_000, .. }));
        assert_eq!(receiver.numbers(100_000).unwrap(), numbers);
        assert!(matches!(receiver.head().unwrap(), Head::End));
        assert!(receiver.head().is_err());
        let refused = Receiver::new(&pipe[..], 99_999).numbers(100_000).unwrap_err();
        assert!(refused.is::<TooMany>(), "{refused}");
    }
}

//! The values of a column, a block of rows in memory at a time.

use crate::h5;
use hdf5::{Dataset, Error, Result};
use std::collections::VecDeque;

/// Rows read at once: whole chunks of the files that this crate writes.
const BLOCK_ROWS: usize = 4 * h5::CHUNK_ROWS;

/// A stretch of a column.
pub(crate) enum Part {
    /// So many rows without a value.
    Missing(usize),
    /// A dataset of numbers of one dimension.
    Rows(Dataset),
}

/// Iterates over the values of a column; ends early where one can't be read, which [`Blocks::finish`] tells.
pub(crate) struct Blocks {
    parts: VecDeque<Part>,
    /// The row of the first part to read next.
    row: usize,
    block: std::vec::IntoIter<f64>,
    error: Option<Error>,
}

impl Blocks {
    pub(crate) fn new(parts: Vec<Part>) -> Self {
        Self { parts: parts.into(), row: 0, block: Vec::new().into_iter(), error: None }
    }

    /// Whether all that was asked for could be read.
    pub(crate) fn finish(self) -> Result<()> {
        self.error.map_or(Ok(()), Err)
    }

    /// The next block; `None` at the end.
    pub(crate) fn read(&mut self) -> Result<Option<Vec<f64>>> {
        while let Some(part) = self.parts.front() {
            let rows = match part {
                Part::Missing(rows) => *rows,
                Part::Rows(dataset) => dataset.size(),
            };
            let end = rows.min(self.row + BLOCK_ROWS);
            if self.row == end {
                self.parts.pop_front();
                self.row = 0;
                continue;
            }
            let range = self.row..end;
            self.row = end;
            return Ok(Some(match part {
                Part::Missing(_) => vec![f64::NAN; range.len()],
                Part::Rows(dataset) => dataset.read_slice_1d::<f64, _>(range)?.to_vec(),
            }));
        }
        Ok(None)
    }
}

impl Iterator for Blocks {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        if let Some(value) = self.block.next() {
            return Some(value);
        }
        match self.read() {
            Ok(block) => self.block = block?.into_iter(),
            Err(error) => {
                self.error = Some(error);
                self.parts.clear();
            }
        }
        self.block.next()
    }
}

//! The cells of a line: between separators, in quotes where they hold one.

use csv_core::{ReadRecordResult, Reader, ReaderBuilder};

/// Splits lines; keeps its buffers from line to line.
pub(crate) struct Cells {
    reader: Reader,
    text: Vec<u8>,
    ends: Vec<usize>,
    /// Bytes and ends in use.
    filled: (usize, usize),
    /// Several spaces part two cells as one does.
    spaces: bool,
}

impl Cells {
    pub(crate) fn new(separator: u8) -> Self {
        let reader = ReaderBuilder::new().delimiter(separator).build();
        Self { reader, text: Vec::new(), ends: Vec::new(), filled: (0, 0), spaces: separator == b' ' }
    }

    /// Takes a line apart. A quote that is opened in it ends with it.
    pub(crate) fn split(&mut self, line: &[u8]) {
        self.reader.reset();
        // A record is never longer than its line, and has at most one cell more than it has bytes.
        self.text.resize(self.text.len().max(line.len() + 1), 0);
        self.ends.resize(self.ends.len().max(line.len() + 2), 0);
        self.filled = (0, 0);
        let mut rest = line;
        loop {
            let (text, ends) = (self.text.get_mut(self.filled.0..), self.ends.get_mut(self.filled.1..));
            let (Some(text), Some(ends)) = (text, ends) else { return };
            // An empty input tells the reader that this was all.
            let (result, read, bytes, cells) = self.reader.read_record(rest, text, ends);
            self.filled = (self.filled.0 + bytes, self.filled.1 + cells);
            rest = rest.get(read..).unwrap_or_default();
            match result {
                ReadRecordResult::InputEmpty if read > 0 || bytes > 0 || !rest.is_empty() => {}
                _ => return,
            }
        }
    }

    /// The cells of the line that was split last; between spaces, empty ones are none.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &[u8]> {
        let ends = self.ends.iter().take(self.filled.1).copied();
        let begins = std::iter::once(0).chain(ends.clone());
        let cells = begins.zip(ends).map(|(begin, end)| self.text.get(begin..end).unwrap_or_default());
        cells.filter(move |cell| !(self.spaces && cell.is_empty()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_of_lines() {
        type Case<'a> = (u8, &'a [u8], &'a [&'a [u8]]);
        let cases: [Case<'_>; 7] = [
            (b';', b"1;;2", &[b"1", b"", b"2"]),
            (b',', b"\"a,b\",\"say \"\"no\"\"\",3", &[b"a,b", b"say \"no\"", b"3"]),
            (b',', b"\"open,2", &[b"open,2"]),
            (b' ', b"  1   2 ", &[b"1", b"2"]),
            (b'\t', b"1\t", &[b"1", b""]),
            (b'\t', b"x", &[b"x"]),
            (b',', b"", &[]),
        ];
        for (separator, line, expected) in cases {
            let mut cells = Cells::new(separator);
            // Twice: nothing of a line stays.
            cells.split(b"9,9;9 9\t\"");
            cells.split(line);
            let found: Vec<&[u8]> = cells.iter().collect();
            assert_eq!(found, expected, "{line:?}");
        }
    }
}

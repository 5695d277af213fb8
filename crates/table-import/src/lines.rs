//! The lines of a text, one at a time, none longer than a bound: a file without line ends can't take all memory.

use anyhow::bail;
use std::io::{BufRead, Read};

/// No table's line is longer: ten thousand columns of a hundred characters.
pub(crate) const MOST_BYTES: usize = 1 << 20;

/// Reads lines and counts them.
pub(crate) struct Lines<R> {
    reader: R,
    line: Vec<u8>,
    number: u64,
}

impl<R: BufRead> Lines<R> {
    pub(crate) fn new(reader: R) -> Self {
        Self { reader, line: Vec::new(), number: 0 }
    }

    /// The next line without its end, and its number from 1; `None` at the end.
    ///
    /// # Errors
    /// What the system says, and a line that is too long.
    pub(crate) fn next(&mut self) -> anyhow::Result<Option<(u64, &[u8])>> {
        self.line.clear();
        let most = MOST_BYTES as u64 + 2;
        if self.reader.by_ref().take(most).read_until(b'\n', &mut self.line)? == 0 {
            return Ok(None);
        }
        self.number += 1;
        if self.current().1.len() > MOST_BYTES {
            bail!("line {}: longer than {MOST_BYTES} bytes, expected a row of a table", self.number);
        }
        Ok(Some(self.current()))
    }

    /// Whether the line that was read last has an end: else the file ends with it.
    pub(crate) fn has_end(&self) -> bool {
        self.line.ends_with(b"\n")
    }

    /// The line that was read last, and its number.
    pub(crate) fn current(&self) -> (u64, &[u8]) {
        let line = self.line.strip_suffix(b"\n").unwrap_or(&self.line);
        (self.number, line.strip_suffix(b"\r").unwrap_or(line))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_counted_and_bounded() {
        let mut lines = Lines::new(&b"a\r\n\nb"[..]);
        assert_eq!(lines.next().unwrap(), Some((1, &b"a"[..])));
        assert_eq!(lines.next().unwrap(), Some((2, &b""[..])));
        assert_eq!(lines.next().unwrap(), Some((3, &b"b"[..])));
        assert_eq!(lines.next().unwrap(), None);
        let endless = std::io::BufReader::new(std::io::repeat(b'7'));
        let error = Lines::new(endless).next().unwrap_err().to_string();
        assert!(error.contains("line 1: longer than"), "{error}");
    }
}

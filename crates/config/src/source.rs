//! A text with its name: where a byte stands in lines and columns, and what was found wrong so far.

use std::cell::RefCell;
use std::ops::Range;

use crate::asked::Asked;
use crate::error::{ConfigError, ConfigErrors};

/// The largest file that is read. A scenario of a day with a set-point a minute has a tenth of it.
const LARGEST_FILE_BYTES: usize = 1 << 20;

/// More findings than anybody reads; the rest would only cost time.
const MOST_FINDINGS: usize = 100;

/// Editors hide it, so it is no column.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// A file's text, its name, and the findings. Collects, so that one run of `check` shows all errors.
pub(crate) struct Source<'a> {
    file: &'a str,
    text: &'a str,
    line_starts: Vec<usize>,
    findings: RefCell<Vec<ConfigError>>,
    /// What the reader asked for, where that is noted.
    pub(crate) asked: Asked,
}

impl<'a> Source<'a> {
    pub(crate) fn new(text: &'a str, file: &'a str) -> Self {
        let line_starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Self { file, text, line_starts, findings: RefCell::new(Vec::new()), asked: Asked::default() }
    }

    /// Line and column of a byte, both from 1; the column in characters.
    pub(crate) fn position(&self, byte: usize) -> (usize, usize) {
        let byte = byte.min(self.text.len());
        let line = self.line_starts.partition_point(|&start| start <= byte).max(1);
        let start = self.line_starts.get(line - 1).copied().unwrap_or(0);
        let rest = self.text.get(start..).unwrap_or("").char_indices();
        let before = rest.take_while(|&(at, _)| start + at < byte);
        (line, before.filter(|&(_, c)| c != BYTE_ORDER_MARK).count() + 1)
    }

    /// The text between two bytes; empty when they don't fit the text.
    pub(crate) fn slice(&self, span: &Range<usize>) -> &'a str {
        self.text.get(span.clone()).unwrap_or("")
    }

    /// Notes something wrong.
    pub(crate) fn report(
        &self,
        byte: usize,
        key: &str,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) {
        if self.findings.borrow().len() >= MOST_FINDINGS {
            return;
        }
        let (line, column) = self.position(byte);
        self.findings.borrow_mut().push(ConfigError {
            file: self.file.to_owned(),
            line,
            column,
            key: key.to_owned(),
            found: found.into(),
            expected: expected.into(),
        });
    }

    /// Notes a file that is too large; true if it is not.
    pub(crate) fn has_sane_size(&self) -> bool {
        let sane = self.text.len() <= LARGEST_FILE_BYTES;
        if !sane {
            self.report(0, "", format!("a file of {} bytes", self.text.len()), "at most 1 MiB");
        }
        sane
    }

    /// How much was found wrong so far.
    pub(crate) fn finding_count(&self) -> usize {
        self.findings.borrow().len()
    }

    /// Whether nothing was found wrong so far.
    pub(crate) fn is_clean(&self) -> bool {
        self.finding_count() == 0
    }

    /// The findings; asked for only when there is one.
    pub(crate) fn into_errors(self) -> ConfigErrors {
        ConfigErrors::from_findings(self.findings.into_inner())
    }
}

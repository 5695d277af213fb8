//! A range of a table's rows, counted from 1: `5..10`, `5..`, `..10`.

use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// The rows wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Rows {
    first: usize,
    last: usize,
}

impl Rows {
    /// Whether a row, counted from 0, is wanted.
    pub fn holds(&self, index: usize) -> bool {
        index + 1 >= self.first && index < self.last
    }
}

impl TryFrom<String> for Rows {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Rows> for String {
    fn from(rows: Rows) -> Self {
        let last = if rows.last == usize::MAX { Self::new() } else { rows.last.to_string() };
        format!("{}..{last}", rows.first)
    }
}

impl FromStr for Rows {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || format!("{text:?}, expected FIRST..LAST with rows counted from 1");
        let (first, last) = text.split_once("..").ok_or_else(expected)?;
        let number = |text: &str, open: usize| match text.trim() {
            "" => Ok(open),
            digits => digits.parse().map_err(|_| expected()),
        };
        let rows = Self { first: number(first, 1)?, last: number(last, usize::MAX)? };
        if rows.first == 0 || rows.last < rows.first { Err(expected()) } else { Ok(rows) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges() {
        let rows: Rows = "3..4".parse().unwrap();
        assert_eq!((0..6).filter(|k| rows.holds(*k)).collect::<Vec<_>>(), [2, 3]);
        assert!("5..".parse::<Rows>().unwrap().holds(1_000_000));
        for wrong in ["", "5", "0..3", "4..3", "a..b"] {
            assert!(wrong.parse::<Rows>().is_err(), "{wrong}");
        }
    }
}

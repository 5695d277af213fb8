//! What is wrong with the text of an expression, and where.

use std::fmt;

/// Something wrong in the text of an expression, or with one of its parameters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExpressionError {
    /// Characters before the place in the text.
    pub at: usize,
    /// The parameter that is wrong, by its place among those given, where it isn't the text.
    pub parameter: Option<usize>,
    /// What stands there.
    pub found: String,
    /// What may stand there.
    pub expected: String,
}

impl ExpressionError {
    /// Something wrong behind so many characters of the text.
    pub fn new(at: usize, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self { at, parameter: None, found: found.into(), expected: expected.into() }
    }

    pub(crate) fn of_parameter(place: usize, found: String, expected: &str) -> Self {
        Self { at: 0, parameter: Some(place), found, expected: expected.to_owned() }
    }
}

impl fmt::Display for ExpressionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.parameter.is_none() {
            write!(f, "column {}: ", self.at + 1)?;
        }
        write!(f, "found {}, expected {}", self.found, self.expected)
    }
}

impl std::error::Error for ExpressionError {}

/// The known name within two edits of a misspelt one (a third of its length at most), if any, as the beginning of what is expected.
pub(crate) fn hint<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    const LONGEST: usize = 80;
    if name.len() > LONGEST {
        return String::new();
    }
    let most_edits = (name.chars().count() / 3).clamp(1, 2);
    let near = known.map(|other| (strsim::levenshtein(name, other), other));
    let nearest = near.filter(|(edits, _)| *edits <= most_edits).min_by_key(|(edits, _)| *edits);
    nearest.map_or_else(String::new, |(_, other)| format!("{other} (did you mean it?) or "))
}

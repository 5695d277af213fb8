//! Comments for a model that is written: why a number is what it is.

use std::collections::BTreeMap;

/// Comments for the file, its sections and its keys. Text may have several lines; it is written behind `#`.
///
/// A section is named as in the file, `friction`, an effect by its index, `effect[0]`; a key by section and key,
/// `friction.coulomb_torque_nm`. A comment for something that the model does not have is not written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ModelComments {
    header: String,
    by_path: BTreeMap<String, String>,
}

impl ModelComments {
    /// No comments.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the text that opens the file.
    #[must_use]
    pub fn with_header(mut self, text: impl Into<String>) -> Self {
        self.header = text.into();
        self
    }

    /// Sets the text above a section: `friction`, `effect[0]`.
    #[must_use]
    pub fn with_section(mut self, section: &str, text: impl Into<String>) -> Self {
        self.by_path.insert(section.to_owned(), text.into());
        self
    }

    /// Sets the text of a key: behind its value if it has one line, above it if it has more.
    #[must_use]
    pub fn with_key(mut self, section: &str, key: &str, text: impl Into<String>) -> Self {
        self.by_path.insert(format!("{section}.{key}"), text.into());
        self
    }

    /// The header as lines of comment.
    pub(super) fn header_lines(&self) -> String {
        comment_lines(&self.header)
    }

    /// A section's comment as lines.
    pub(super) fn section_lines(&self, section: &str) -> String {
        comment_lines(self.by_path.get(section).map_or("", String::as_str))
    }

    /// A key's comment: lines above, and what follows the value.
    pub(super) fn key_parts(&self, section: &str, key: &str) -> (String, String) {
        let text = self.by_path.get(&format!("{section}.{key}")).map_or("", String::as_str);
        if text.contains('\n') {
            return (comment_lines(text), String::new());
        }
        let lines = comment_lines(text);
        let behind = if lines.is_empty() { String::new() } else { format!("  {}", lines.trim_end()) };
        (String::new(), behind)
    }
}

/// Each line behind a `#`; characters that TOML forbids in comments become blanks.
fn comment_lines(text: &str) -> String {
    let clean =
        |line: &str| -> String { line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect() };
    text.trim_end().lines().map(|line| format!("# {}", clean(line)).trim_end().to_owned() + "\n").collect()
}

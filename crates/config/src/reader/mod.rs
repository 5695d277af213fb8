//! A typed reader over a parsed TOML text: every value with its place, every key accounted for.
//!
//! A refused value reads as a placeholder (NaN, zero, empty) and is reported once: comparisons with NaN are false, so
//! later checks written as "if it exceeds, report" stay silent about it, and all other errors of the file are still found.

mod field;

pub(crate) use field::{Field, Scalar};

use std::cell::RefCell;

use toml::Spanned;
use toml::de::DeTable;

use crate::asked::{Asked, Shape, Visit};
use crate::bounds::Bounds;
use crate::error::ConfigErrors;
use crate::source::Source;
use crate::suggest::nearest;
use crate::units::{Dimension, shown};
use valve_model::ParamError;

/// Reads a whole text: TOML of this format and version, whose sections `read` takes. `file` names it in errors.
///
/// # Errors
/// All that is wrong in the text.
pub(crate) fn parse<T>(
    text: &str,
    file: &str,
    format: &str,
    version: u64,
    read: impl FnOnce(Section<'_>) -> Option<T>,
) -> Result<T, ConfigErrors> {
    let source = Source::new(text, file);
    let mut found = None;
    if let Some(document) = parse_document(text, &source) {
        let root = Section::root(&source, &document);
        if root.has_format(format, version) {
            found = read(root);
        }
    }
    match found {
        Some(found) if source.is_clean() => Ok(found),
        _ => Err(source.into_errors()),
    }
}

/// What reading a text asks of it, whatever is wrong with it.
pub(crate) fn asked<T>(
    text: &str,
    format: &str,
    version: u64,
    read: impl FnOnce(Section<'_>) -> T,
) -> Vec<Visit> {
    let mut source = Source::new(text, "");
    source.asked = Asked::noting();
    if let Some(document) = parse_document(text, &source) {
        let root = Section::root(&source, &document);
        root.has_format(format, version);
        read(root);
    }
    source.asked.into_visits()
}

/// What follows so many mistakes of syntax follows from them, or the text is none of ours.
const MOST_SYNTAX_ERRORS: usize = 5;

/// Parses a text as TOML; reports what is wrong with it and gives `None` then. Depth of nesting is bounded by `toml`.
pub(crate) fn parse_document<'a>(text: &'a str, source: &Source<'a>) -> Option<DeTable<'a>> {
    if !source.has_sane_size() {
        return None;
    }
    let (document, errors) = DeTable::parse_recoverable(text);
    for error in errors.iter().take(MOST_SYNTAX_ERRORS) {
        let start = error.span().unwrap_or(0..0).start;
        match quantity_at(text, start) {
            Some(value) => source.report(start, "", value.to_owned(), format!("quotes: \"{value}\"")),
            None => {
                let found = format!("a mistake of syntax ({})", error.message());
                source.report(start, "", found, "valid TOML");
            }
        }
    }
    errors.is_empty().then(|| document.into_inner())
}

/// What stands for a value at a place where the text is no TOML, if it is a number with a unit that lacks its quotes.
fn quantity_at(text: &str, place: usize) -> Option<&str> {
    let begin = text.get(..place)?.rfind('\n').map_or(0, |end| end + 1);
    let line = text.get(begin..)?.lines().next()?;
    let (_, value) = line.split_once('=')?;
    let value = value.split('#').next()?.trim();
    let unit = value.trim_start_matches(|c: char| c.is_ascii_digit() || "+-.".contains(c)).trim_start();
    let is_unit = unit.chars().all(|c| c.is_alphabetic() || "/^*·²³%°".contains(c) || c.is_ascii_digit());
    (unit.len() < value.len() && !unit.is_empty() && is_unit).then_some(value)
}

/// A table, the keys asked of it so far, and its place.
pub(crate) struct Section<'a> {
    source: &'a Source<'a>,
    /// Path of the section, empty for the file itself.
    path: String,
    /// Where its header stands.
    start: usize,
    table: &'a DeTable<'a>,
    asked: RefCell<Vec<String>>,
    /// Findings in the file before this section was read.
    findings_before: usize,
    /// Its number among the tables that were read.
    visit: usize,
}

impl<'a> Section<'a> {
    /// The whole file.
    pub(crate) fn root(source: &'a Source<'a>, table: &'a DeTable<'a>) -> Self {
        Self::new(source, String::new(), 0, table)
    }

    fn new(source: &'a Source<'a>, path: String, start: usize, table: &'a DeTable<'a>) -> Self {
        let visit = source.asked.visit(&path);
        Self {
            visit,
            source,
            path,
            start,
            table,
            asked: RefCell::default(),
            findings_before: source.finding_count(),
        }
    }

    /// Whether nothing was found wrong since this section was opened.
    pub(crate) fn is_clean(&self) -> bool {
        self.source.finding_count() == self.findings_before
    }

    fn key_path(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// The value of a key, if there is one. The key counts as known from here on.
    pub(crate) fn find(&self, key: &str) -> Option<Field<'a>> {
        if !self.asked.borrow().iter().any(|asked| asked == key) {
            self.asked.borrow_mut().push(key.to_owned());
        }
        self.source.asked.note(self.visit, &self.key_path(key), |_| {});
        let value = self.table.get(key)?;
        let span = value.span();
        Some(Field {
            source: self.source,
            path: self.key_path(key),
            span,
            value: value.get_ref(),
            visit: self.visit,
        })
    }

    /// The value of a key that must be there.
    pub(crate) fn require(&self, key: &str, expected: &str) -> Option<Field<'a>> {
        let field = self.find(key);
        self.source.asked.note(self.visit, &self.key_path(key), |key| key.required = true);
        if field.is_none() {
            self.source.report(self.start, &self.key_path(key), "nothing", expected);
        }
        field
    }

    /// Every key that there is: its name, where it stands, and its value. All count as known from here on.
    pub(crate) fn all(&self) -> Vec<(String, Field<'a>, Field<'a>)> {
        let named = |(key, _): (&'a Spanned<std::borrow::Cow<'a, str>>, _)| {
            let name: &str = key.get_ref();
            let value = self.find(name)?;
            Some((name.to_owned(), Field { span: key.span(), ..value.clone() }, value))
        };
        self.table.iter().filter_map(named).collect()
    }

    /// Notes what a key's value may be, there or not.
    pub(crate) fn expects(&self, key: &str, shape: Shape) {
        self.source.asked.shape(self.visit, &self.key_path(key), shape);
    }

    /// Notes that which keys there are depends on this word of this key.
    pub(crate) fn depends_on(&self, key: &str, word: &str) {
        self.source.asked.chosen(self.visit, &self.key_path(key), word);
    }

    /// Reports something about a key that is not there.
    pub(crate) fn refuse_key(&self, key: &str, found: impl Into<String>, expected: impl Into<String>) {
        self.source.report(self.start, &self.key_path(key), found, expected);
    }

    /// Reports something about the section as a whole.
    pub(crate) fn refuse(&self, found: impl Into<String>, expected: impl Into<String>) {
        self.source.report(self.start, &self.path, found, expected);
    }

    /// A quantity that must be there; NaN if it is not or is refused.
    pub(crate) fn quantity(&self, key: &str, dimension: Dimension, bounds: Bounds) -> f64 {
        self.expects(key, Shape::Quantity(dimension, bounds));
        let field = self.require(key, &bounds.describe(dimension));
        field.map_or(f64::NAN, |field| field.quantity(dimension, bounds))
    }

    /// A quantity that may be left out.
    pub(crate) fn optional_quantity(&self, key: &str, dimension: Dimension, bounds: Bounds) -> Option<f64> {
        self.expects(key, Shape::Quantity(dimension, bounds));
        self.find(key).map(|field| field.quantity(dimension, bounds))
    }

    /// A whole number that may be left out.
    pub(crate) fn integer_or(&self, key: &str, range: std::ops::RangeInclusive<u64>, default: u64) -> u64 {
        self.expects(key, Shape::Integer(*range.start(), *range.end()));
        self.find(key).map_or(default, |field| field.integer(range))
    }

    /// A plain number that must be there; NaN if it is not or is refused.
    pub(crate) fn number(&self, key: &str) -> f64 {
        self.expects(key, Shape::Number);
        self.require(key, "a number").map_or(f64::NAN, |field| field.number("a finite number"))
    }

    /// A plain number that may be left out.
    pub(crate) fn optional_number(&self, key: &str) -> Option<f64> {
        self.expects(key, Shape::Number);
        self.find(key).map(|field| field.number("a finite number"))
    }

    /// A count that must be there; 0 if it is not or is refused.
    pub(crate) fn count(&self, key: &str) -> u32 {
        self.expects(key, Shape::Integer(0, u64::from(u32::MAX)));
        let count =
            self.require(key, "a whole number").map_or(0, |field| field.integer(0..=u64::from(u32::MAX)));
        u32::try_from(count).unwrap_or(0)
    }

    /// A text that must be there; empty if it is not or is refused.
    pub(crate) fn text(&self, key: &str, expected: &str) -> String {
        self.expects(key, Shape::Text);
        self.require(key, expected).map_or_else(String::new, |field| field.text(expected))
    }

    /// A sub-section that must be there.
    pub(crate) fn section(&self, key: &str) -> Option<Section<'a>> {
        let expected = format!("a section [{}]", self.key_path(key));
        self.expects(key, Shape::Table);
        self.require(key, &expected)?.section(&expected)
    }

    /// A sub-section that may be left out.
    pub(crate) fn optional_section(&self, key: &str) -> Option<Section<'a>> {
        let expected = format!("a section [{}]", self.key_path(key));
        self.expects(key, Shape::Table);
        self.find(key)?.section(&expected)
    }

    /// The elements of a list that may be left out: `[[key]]` or an array.
    pub(crate) fn list(&self, key: &str) -> Vec<Field<'a>> {
        self.expects(key, Shape::List);
        self.find(key).map_or_else(Vec::new, |field| field.elements())
    }

    /// The keys among `candidates` that are there.
    pub(crate) fn present(&self, candidates: &[&'static str]) -> Vec<&'static str> {
        candidates.iter().copied().filter(|key| self.find(key).is_some()).collect()
    }

    /// Reads `format` and `format_version`; false if it is another file altogether, so that reading on makes no sense.
    pub(crate) fn has_format(&self, format: &str, version: u64) -> bool {
        self.expects("format", Shape::Choice(vec![format.to_owned()]));
        self.expects("format_version", Shape::Integer(version, version));
        let expected = format!("\"{format}\"");
        let known = self.require("format", &expected).is_some_and(|field| {
            let known = field.value.as_str() == Some(format);
            if !known {
                field.refuse(&expected);
            }
            known
        });
        let expected = version.to_string();
        let version_known = self.require("format_version", &expected).is_some_and(|field| {
            let known = field.whole_number() == i64::try_from(version).ok();
            if !known {
                field.refuse(&expected);
            }
            known
        });
        known && version_known
    }

    /// Ends a section: unknown keys first, then what the model itself refuses, unless a value is missing already.
    pub(crate) fn conclude(self, validated: Result<(), ParamError>) {
        if let Err(error) = validated
            && self.is_clean()
        {
            match self.find(error.key) {
                Some(field) => field.refuse(error.expected),
                None => self.refuse_key(error.key, "nothing", error.expected),
            }
        }
        self.finish();
    }

    /// Reports every key that nothing asked for.
    pub(crate) fn finish(self) {
        let asked = self.asked.borrow();
        for key in self.table.keys() {
            let name: &str = key.get_ref();
            if asked.iter().any(|known| known == name) {
                continue;
            }
            let hint = nearest(name, &asked)
                .map_or_else(String::new, |near| format!("{near} (did you mean it?) or "));
            let others: Vec<&str> = asked.iter().map(String::as_str).collect();
            let expected = format!("{hint}one of {}", others.join(", "));
            let path = self.key_path(&shown(name));
            self.source.report(key.span().start, &path, "an unknown key", expected);
        }
    }
}

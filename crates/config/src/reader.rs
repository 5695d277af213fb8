//! A typed reader over a parsed TOML text: every value with its place, every key accounted for.
//!
//! A refused value reads as a placeholder (NaN, zero, empty) and is reported once: comparisons with NaN are false, so
//! later checks written as "if it exceeds, report" stay silent about it, and all other errors of the file are still found.

use std::cell::RefCell;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::asked::{Asked, Shape, Visit};
use crate::bounds::Bounds;
use crate::error::ConfigErrors;
use crate::source::Source;
use crate::suggest::nearest;
use crate::units::{Dimension, parse_quantity, shown};
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

/// Parses a text as TOML; reports what is wrong with it and gives `None` then. Depth of nesting is bounded by `toml`.
pub(crate) fn parse_document<'a>(text: &'a str, source: &Source<'a>) -> Option<DeTable<'a>> {
    if !source.has_sane_size() {
        return None;
    }
    let (document, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let span = error.span().unwrap_or(0..0);
        source.report(span.start, "", error.message().to_owned(), "valid TOML");
    }
    errors.is_empty().then(|| document.into_inner())
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

/// A number by a name that the user chose.
pub(crate) struct NamedNumber<'a> {
    /// The name.
    pub(crate) name: String,
    /// The number; NaN if it was refused.
    pub(crate) number: f64,
    /// Where the name stands.
    pub(crate) place: Field<'a>,
}

/// A single value, whatever it is.
pub(crate) enum Scalar {
    /// A finite number.
    Number(f64),
    /// A text that is neither empty nor holds control characters.
    Text(String),
    /// True or false.
    Flag(bool),
}

/// A value with its path and place.
#[derive(Clone)]
pub(crate) struct Field<'a> {
    source: &'a Source<'a>,
    path: String,
    span: Range<usize>,
    value: &'a DeValue<'a>,
    /// The table that it stands in, by its number among those that were read.
    visit: usize,
}

impl<'a> Field<'a> {
    fn expects(&self, shape: Shape) {
        self.source.asked.shape(self.visit, &self.path, shape);
    }

    /// What stands in the file, without quotes, fit for a message.
    pub(crate) fn found(&self) -> String {
        match self.value {
            DeValue::String(text) => shown(text),
            DeValue::Table(_) => "a table".to_owned(),
            _ => shown(self.source.slice(&self.span)),
        }
    }

    /// Reports that this value is not what was expected.
    pub(crate) fn refuse(&self, expected: impl Into<String>) {
        self.refuse_as(self.found(), expected);
    }

    /// Reports that this value is wrong, described in the caller's words.
    pub(crate) fn refuse_as(&self, found: impl Into<String>, expected: impl Into<String>) {
        self.source.report(self.span.start, &self.path, found, expected);
    }

    /// A number or a text as it stands, or a truth value where one may be; `None`, and reported, for anything else.
    pub(crate) fn scalar(&self, may_be_flag: bool, expected: &str) -> Option<Scalar> {
        let flag = may_be_flag.then_some(Shape::Boolean);
        [Shape::Number, Shape::Text].into_iter().chain(flag).for_each(|shape| self.expects(shape));
        let scalar = match self.value {
            DeValue::String(text) if !text.trim().is_empty() && !text.contains(char::is_control) => {
                Some(Scalar::Text(text.to_string()))
            }
            DeValue::Boolean(flag) if may_be_flag => Some(Scalar::Flag(*flag)),
            _ => self.plain_number().map(Scalar::Number),
        };
        if scalar.is_none() {
            self.refuse(expected);
        }
        scalar
    }

    /// Line and column of the value, from 1.
    pub(crate) fn position(&self) -> (usize, usize) {
        self.source.position(self.span.start)
    }

    /// Where the value starts, in bytes.
    pub(crate) fn start(&self) -> usize {
        self.span.start
    }

    /// Line of the value, from 1.
    pub(crate) fn line(&self) -> usize {
        self.source.position(self.span.start).0
    }

    /// A number or a text with a unit; NaN if refused.
    pub(crate) fn quantity(&self, dimension: Dimension, bounds: Bounds) -> f64 {
        self.expects(Shape::Quantity(dimension, bounds));
        let expected = || bounds.describe(dimension);
        if let DeValue::String(text) = self.value {
            return match parse_quantity(text, dimension) {
                Ok(value) if bounds.contain(value) => value,
                Ok(_) => self.refused(&expected()),
                Err(error) if dimension.si_unit().is_empty() => self.refused(&error.expected),
                Err(error) => self.refused(&format!(
                    "{}; a bare number without quotes is in {}",
                    error.expected,
                    dimension.si_unit()
                )),
            };
        }
        match self.plain_number() {
            Some(value) if bounds.contain(value) => value,
            Some(_) if !dimension.si_unit().is_empty() => {
                let found = format!("{} (bare numbers are in {})", self.found(), dimension.si_unit());
                self.refuse_as(found, expected());
                f64::NAN
            }
            _ => self.refused(&expected()),
        }
    }

    /// A plain finite number; NaN if refused.
    pub(crate) fn number(&self, expected: &str) -> f64 {
        self.expects(Shape::Number);
        self.plain_number().unwrap_or_else(|| self.refused(expected))
    }

    /// Plain finite numbers of an array; empty if refused.
    pub(crate) fn numbers(&self, expected: &str) -> Vec<f64> {
        let DeValue::Array(_) = self.value else {
            self.expects(Shape::List);
            self.refuse(expected);
            return Vec::new();
        };
        self.elements().iter().map(|element| element.number(expected)).collect()
    }

    /// Whether this is a table.
    pub(crate) fn is_table(&self) -> bool {
        matches!(self.value, DeValue::Table(_))
    }

    /// Whether this is an array.
    pub(crate) fn is_array(&self) -> bool {
        self.value.is_array()
    }

    fn refused(&self, expected: &str) -> f64 {
        self.refuse(expected);
        f64::NAN
    }

    fn plain_number(&self) -> Option<f64> {
        let number: f64 = match self.value {
            DeValue::Float(float) => float.as_str().parse().ok()?,
            DeValue::Integer(_) => self.whole_number()? as f64,
            _ => return None,
        };
        number.is_finite().then_some(number)
    }

    fn whole_number(&self) -> Option<i64> {
        let DeValue::Integer(integer) = self.value else { return None };
        i64::from_str_radix(integer.as_str(), integer.radix()).ok()
    }

    /// A whole number within a range; the range's lower end if refused.
    pub(crate) fn integer(&self, range: std::ops::RangeInclusive<u64>) -> u64 {
        self.expects(Shape::Integer(*range.start(), *range.end()));
        let number = self.whole_number().and_then(|number| u64::try_from(number).ok());
        number.filter(|number| range.contains(number)).unwrap_or_else(|| {
            self.refuse(format!("a whole number from {} to {}", range.start(), range.end()));
            *range.start()
        })
    }

    /// A text that is neither empty nor holds control characters; empty if refused.
    pub(crate) fn text(&self, expected: &str) -> String {
        self.expects(Shape::Text);
        match self.value {
            DeValue::String(text) if !text.trim().is_empty() && !text.contains(char::is_control) => {
                text.to_string()
            }
            _ => {
                self.refuse(expected);
                String::new()
            }
        }
    }

    /// Reports something within a text, behind so many of its characters.
    pub(crate) fn refuse_within(
        &self,
        characters: usize,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) {
        let written = self.source.slice(&self.span);
        let inside = written.trim_start_matches(['"', '\'']);
        let before: usize = inside.chars().take(characters).map(char::len_utf8).sum();
        // Behind an escape the characters are not those of the file.
        let shift = if inside.contains('\\') { 0 } else { written.len() - inside.len() + before };
        self.source.report(self.span.start + shift, &self.path, found, expected);
    }

    /// A table of numbers whose names the user chose, in the file's order; those that are none are refused.
    pub(crate) fn named_numbers(&self) -> Vec<NamedNumber<'a>> {
        self.expects(Shape::NamedNumbers);
        let DeValue::Table(table) = self.value else {
            self.refuse("a table of numbers");
            return Vec::new();
        };
        let mut found: Vec<NamedNumber<'a>> = table
            .iter()
            .map(|(key, value)| {
                let name: &str = key.get_ref();
                let path = format!("{}.{}", self.path, shown(name));
                let (source, visit) = (self.source, self.visit);
                let field = Field { source, path, span: value.span(), value: value.get_ref(), visit };
                let number = field.plain_number().unwrap_or_else(|| field.refused("a finite number"));
                let place = Field { span: key.span(), ..field };
                NamedNumber { name: name.to_owned(), number, place }
            })
            .collect();
        found.sort_by_key(|of| of.place.start());
        found
    }

    /// True or false; false if refused.
    pub(crate) fn boolean(&self) -> bool {
        self.expects(Shape::Boolean);
        self.value.as_bool().unwrap_or_else(|| {
            self.refuse("true or false");
            false
        })
    }

    /// One of several words, as the value that goes with it.
    pub(crate) fn choice<T: Copy>(&self, first: (&str, T), others: &[(&str, T)]) -> Option<T> {
        let found = self.value.as_str();
        let known = || std::iter::once(&first).chain(others);
        self.expects(Shape::Choice(known().map(|option| option.0.to_owned()).collect()));
        self.source.asked.chosen(self.visit, &self.path, found.unwrap_or(""));
        let chosen = known().find(|option| Some(option.0) == found).map(|option| option.1);
        if chosen.is_none() {
            let names: Vec<String> = known().map(|option| format!("\"{}\"", option.0)).collect();
            self.refuse(names.join(" or "));
        }
        chosen
    }

    /// The value as a table.
    pub(crate) fn section(&self, expected: &str) -> Option<Section<'a>> {
        self.expects(Shape::Table);
        let DeValue::Table(table) = self.value else {
            self.refuse(expected);
            return None;
        };
        Some(Section::new(self.source, self.path.clone(), self.span.start, table))
    }

    /// The elements of the value as a list, each with its index, from 0, in its path.
    pub(crate) fn elements(&self) -> Vec<Field<'a>> {
        self.expects(Shape::List);
        let DeValue::Array(array) = self.value else {
            self.refuse(format!("a list, or tables [[{}]]", self.path));
            return Vec::new();
        };
        array.iter().enumerate().map(|(index, element)| self.element(index, element)).collect()
    }

    fn element(&self, index: usize, element: &'a Spanned<DeValue<'a>>) -> Field<'a> {
        let path = format!("{}[{index}]", self.path);
        Field { source: self.source, path, span: element.span(), value: element.get_ref(), visit: self.visit }
    }
}

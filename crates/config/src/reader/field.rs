//! A value of a text, with its path and place.

use super::Section;
use crate::asked::Shape;
use crate::bounds::Bounds;
use crate::source::Source;
use crate::suggest::nearest;
use crate::units::{Dimension, parse_quantity, shown};
use std::ops::Range;
use toml::Spanned;
use toml::de::DeValue;

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
    pub(super) source: &'a Source<'a>,
    pub(super) path: String,
    pub(super) span: Range<usize>,
    pub(super) value: &'a DeValue<'a>,
    /// The table that it stands in, by its number among those that were read.
    pub(super) visit: usize,
}

impl<'a> Field<'a> {
    pub(super) fn expects(&self, shape: Shape) {
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

    pub(super) fn whole_number(&self) -> Option<i64> {
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
            let quoted = |name: &str| format!("\"{name}\"");
            let names: Vec<String> = known().map(|option| option.0.to_owned()).collect();
            let near = nearest(found.unwrap_or(""), &names);
            let all: Vec<String> = names.iter().map(|name| quoted(name)).collect();
            self.refuse(near.map_or(all.join(" or "), |near| {
                format!("{} (did you mean it?) or one of {}", quoted(near), all.join(", "))
            }));
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

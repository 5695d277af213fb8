//! What rows of the table of effects are made of.

use crate::effect::spec::{ModelNumber, ParameterSpec, ValueKind};

pub(super) const fn number(
    key: &'static str,
    unit: &'static str,
    (min, max): (f64, f64),
    default: f64,
    range: &'static str,
    meaning: &'static str,
) -> ParameterSpec {
    ParameterSpec { key, unit, kind: ValueKind::Number, min, max, default, range, meaning }
}

pub(super) const fn list(
    key: &'static str,
    unit: &'static str,
    most: usize,
    bound: f64,
    range: &'static str,
    meaning: &'static str,
) -> ParameterSpec {
    ParameterSpec {
        key,
        unit,
        kind: ValueKind::List(most),
        min: -bound,
        max: bound,
        default: 0.0,
        range,
        meaning,
    }
}

pub(super) const fn factor(meaning: &'static str) -> ParameterSpec {
    number("factor", "1", (1e-3, 1e3), 1.0, "a number, 0.001 to 1000", meaning)
}

/// One that may be 0.
pub(super) const fn factor_or_none(meaning: &'static str) -> ParameterSpec {
    number("factor", "1", (0.0, 1e3), 1.0, "a number, 0 to 1000", meaning)
}

/// The highest order of a series over the angle, and most orders that differ from zero.
pub(crate) const MAX_HARMONICS: usize = 128;
pub(crate) const MAX_TERMS: usize = 24;

pub(super) const ANY: f64 = f64::MAX;
pub(super) const FACTOR: &str = "`factor`";
pub(super) const SERIES: &str = "`cos`, `sin`";
pub(super) const HARMONICS: &str = "an array of at most 128 numbers, at most 24 of them other than 0";
pub(super) const POSITIVE: &str = "a number above zero";
pub(super) const NOT_NEGATIVE: &str = "a number, zero or above";
pub(super) const TINY: f64 = f64::MIN_POSITIVE;

/// What only a factor on a number of a section is: the section, the numbers' keys, and what they are in words.
pub(super) const fn factor_on(
    section: &'static str,
    keys: &'static str,
    label: &'static str,
) -> Option<ModelNumber> {
    Some(ModelNumber { section, keys, label })
}

//! Units as text, such as `N*m*s^2/rad^2`: which dimension they have.

use crate::ExpressionError;
use crate::dimension::Dimension;
use crate::function::{Binary, Unary};
use crate::number::Number;
use crate::parse::compile;

/// What a unit may be made of. Parts and multiples are of one dimension: which of them is meant is the formula's business.
const UNITS: [(&str, Dimension); 28] = [
    ("N", Dimension::FORCE),
    ("mN", Dimension::FORCE),
    ("kN", Dimension::FORCE),
    ("m", Dimension::LENGTH),
    ("cm", Dimension::LENGTH),
    ("mm", Dimension::LENGTH),
    ("um", Dimension::LENGTH),
    ("Nm", Dimension::TORQUE),
    ("mNm", Dimension::TORQUE),
    ("Pa", Dimension::PRESSURE),
    ("kPa", Dimension::PRESSURE),
    ("MPa", Dimension::PRESSURE),
    ("bar", Dimension::PRESSURE),
    ("s", Dimension::TIME),
    ("ms", Dimension::TIME),
    ("us", Dimension::TIME),
    ("min", Dimension::TIME),
    ("h", Dimension::TIME),
    ("K", Dimension::TEMPERATURE),
    ("degC", Dimension::TEMPERATURE),
    ("Hz", Dimension::FREQUENCY),
    ("kHz", Dimension::FREQUENCY),
    ("rpm", Dimension::FREQUENCY),
    ("rad", Dimension::NONE),
    ("mrad", Dimension::NONE),
    ("urad", Dimension::NONE),
    ("deg", Dimension::NONE),
    ("turn", Dimension::NONE),
];
const EXPECTED: &str = "products, quotients and powers of N, m, Nm, Pa, bar, s, K, Hz, rpm, rad, deg and their parts, such as N*m*s^2/rad^2; 1 for \
                        a pure number";

/// A unit while it is worked out; `None` for what is none.
#[derive(Debug, Clone, Copy)]
struct Unit {
    of: Option<Dimension>,
    /// What was written as a number.
    number: Option<f64>,
}

impl Number for Unit {
    fn constant(number: f64) -> Self {
        Self { of: Some(Dimension::NONE), number: Some(number) }
    }

    fn one(self, function: Unary) -> Self {
        let negative = self.number.filter(|_| function == Unary::Negative).map(|number| -number);
        Self { of: negative.and(self.of), number: negative }
    }

    fn two(self, other: Self, function: Binary) -> Self {
        let of = match (self.of, other.of, function) {
            (Some(one), Some(two), Binary::Multiply) => Some(one.times(two, 1.0)),
            (Some(one), Some(two), Binary::Divide) => Some(one.times(two, -1.0)),
            (Some(one), Some(_), Binary::Power) => other.number.map(|power| one.to_the(power)),
            _ => None,
        };
        Self { of, number: None }
    }
}

/// The dimension of a unit.
///
/// # Errors
/// A text that is none, or has a unit that is not known.
pub fn unit(text: &str) -> Result<Dimension, ExpressionError> {
    let refused = || ExpressionError::new(0, format!("`{text}`"), EXPECTED);
    let names = UNITS.map(|(name, _)| name);
    let program = compile(text, &names, &[]).map_err(|_| refused())?;
    let units = UNITS.map(|(_, of)| Unit { of: Some(of), number: None });
    program.run(&units).of.ok_or_else(refused)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn units_are_products_quotients_and_powers() {
        let per_s = Dimension::FREQUENCY;
        for (text, expected) in [
            ("1", Some(Dimension::NONE)),
            ("1/s", Some(per_s)),
            ("rad/s", Some(per_s)),
            ("s^-1", Some(per_s)),
            ("N*m", Some(Dimension::TORQUE)),
            ("mNm", Some(Dimension::TORQUE)),
            ("Pa*m^3", Some(Dimension::TORQUE)),
            ("N*m/(rad/s)^2", Some(Dimension::TORQUE.times(per_s, -2.0))),
            ("N*m*s^2/rad^2", Some(Dimension::TORQUE.times(per_s, -2.0))),
            ("1/MPa^0.5", Some(Dimension::PRESSURE.to_the(-0.5))),
            ("degC", Some(Dimension::TEMPERATURE)),
            ("bananas", None),
            ("N + m", None),
            ("sin(rad)", None),
            ("s^s", None),
            ("", None),
            ("lbf*ft", None),
        ] {
            assert_eq!(unit(text).ok(), expected, "{text}");
        }
    }
}

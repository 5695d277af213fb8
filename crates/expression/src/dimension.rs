//! The dimensions of an expression: sums of unlike quantities, and functions of what is no pure number.
//!
//! A written number, and a parameter, may have any unit: what they are multiplied with has then any unit, too. So only what is wrong
//! whatever their units are is found.

use crate::ExpressionError;
use crate::function::{Binary, Unary};
use crate::number::Number;
use crate::program::Program;
use std::fmt;

/// Exponents that differ by less are the same.
const SAME: f64 = 1e-9;
/// Units that are made of pascals and of this power of metres for each.
const DERIVED: [(&str, f64); 2] = [("N*m", 3.0), ("N", 2.0)];

/// A product of powers of seconds, kelvins, pascals and metres. Angles are pure numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dimension {
    powers: [f64; 4],
}

impl Dimension {
    /// A pure number, or an angle.
    pub const NONE: Self = Self { powers: [0.0; 4] };
    /// A time.
    pub const TIME: Self = Self { powers: [1.0, 0.0, 0.0, 0.0] };
    /// A frequency, or a speed of rotation.
    pub const FREQUENCY: Self = Self { powers: [-1.0, 0.0, 0.0, 0.0] };
    /// A temperature.
    pub const TEMPERATURE: Self = Self { powers: [0.0, 1.0, 0.0, 0.0] };
    /// A pressure.
    pub const PRESSURE: Self = Self { powers: [0.0, 0.0, 1.0, 0.0] };
    /// A length.
    pub const LENGTH: Self = Self { powers: [0.0, 0.0, 0.0, 1.0] };
    /// A force, a pressure on an area.
    pub const FORCE: Self = Self { powers: [0.0, 0.0, 1.0, 2.0] };
    /// A torque, a force on an arm.
    pub const TORQUE: Self = Self { powers: [0.0, 0.0, 1.0, 3.0] };

    /// The same to a power.
    #[must_use]
    pub fn to_the(self, power: f64) -> Self {
        Self { powers: self.powers.map(|of| of * power) }
    }

    pub(crate) fn times(self, other: Self, power: f64) -> Self {
        let mut powers = self.powers;
        powers.iter_mut().zip(other.powers).for_each(|(own, more)| *own += power * more);
        Self { powers }
    }

    /// Whether it is that of the other.
    pub fn is(self, other: Self) -> bool {
        self.powers.iter().zip(other.powers).all(|(one, two)| (one - two).abs() < SAME)
    }
}

impl Dimension {
    /// The units with their powers; newton metres and newtons in place of pascals and metres where these make them.
    fn units(self) -> Vec<(&'static str, f64)> {
        let [time, warmth, pascals, metres] = self.powers;
        let whole = |(_, arm): &&(&str, f64)| pascals.abs() > SAME && (metres - arm * pascals).abs() < SAME;
        let derived = DERIVED.iter().find(whole).map(|(unit, _)| vec![(*unit, pascals)]);
        let of = derived.unwrap_or_else(|| vec![("Pa", pascals), ("m", metres)]);
        [of, vec![("K", warmth), ("s", time)]].concat()
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let units = self.units();
        let with = |sign: f64| -> Vec<String> {
            let of = units.iter().filter(|(_, power)| sign * power > SAME);
            let text = |(unit, power): &(&str, f64)| match power.abs() {
                power if (power - 1.0).abs() < SAME => (*unit).to_owned(),
                power if unit.contains('*') => format!("({unit})^{power}"),
                power => format!("{unit}^{power}"),
            };
            of.map(text).collect()
        };
        let (above, below) = (with(1.0).join("*"), with(-1.0));
        let above = if above.is_empty() { "1".to_owned() } else { above };
        match below.as_slice() {
            [] if above == "1" => f.write_str("a pure number"),
            [] => f.write_str(&above),
            [one] => write!(f, "{above}/{one}"),
            many => write!(f, "{above}/({})", many.join("*")),
        }
    }
}

/// What an operation makes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Quantity {
    /// A number of any unit, known where it was written.
    Any(Option<f64>),
    Of(Dimension),
    Wrong(Clash),
}

/// Quantities that don't go together.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Clash {
    Unlike(Dimension, Dimension),
    Argument(Dimension),
}

impl Number for Quantity {
    fn constant(number: f64) -> Self {
        Self::Any(Some(number))
    }

    fn one(self, function: Unary) -> Self {
        let Self::Of(dimension) = self else {
            // A number of any unit stays one; what is wrong stays wrong.
            return if let Self::Any(_) = self { Self::Any(None) } else { self };
        };
        match function {
            Unary::Negative | Unary::Absolute => self,
            Unary::Sign => Self::Of(Dimension::NONE),
            Unary::Root => Self::Of(dimension.to_the(0.5)),
            Unary::Exponential
            | Unary::Logarithm
            | Unary::Sine
            | Unary::Cosine
            | Unary::Tangent
            | Unary::ArcSine
            | Unary::ArcCosine
            | Unary::ArcTangent
            | Unary::HyperbolicTangent => {
                if dimension.is(Dimension::NONE) {
                    self
                } else {
                    Self::Wrong(Clash::Argument(dimension))
                }
            }
        }
    }

    fn two(self, other: Self, function: Binary) -> Self {
        let (one, two) = match (self, other) {
            (Self::Wrong(_), _) => return self,
            (_, Self::Wrong(_)) => return other,
            (Self::Of(base), Self::Any(Some(power))) if function == Binary::Power => {
                return Self::Of(base.to_the(power));
            }
            (Self::Of(one), Self::Of(two)) => (one, two),
            (Self::Of(of), Self::Any(_)) | (Self::Any(_), Self::Of(of)) => {
                return beside_a_number(of, function);
            }
            (Self::Any(_), Self::Any(_)) => return Self::Any(None),
        };
        let alike = |made: Self| if one.is(two) { made } else { Self::Wrong(Clash::Unlike(one, two)) };
        match function {
            Binary::Add | Binary::Subtract | Binary::Least | Binary::Greatest | Binary::Hypotenuse => {
                alike(self)
            }
            Binary::ArcTangent2 => alike(Self::Of(Dimension::NONE)),
            Binary::Multiply => Self::Of(one.times(two, 1.0)),
            Binary::Divide => Self::Of(one.times(two, -1.0)),
            Binary::Power if two.is(Dimension::NONE) => Self::Any(None),
            Binary::Power => Self::Wrong(Clash::Argument(two)),
        }
    }
}

/// What a quantity makes with a number of any unit.
fn beside_a_number(of: Dimension, function: Binary) -> Quantity {
    match function {
        Binary::Add | Binary::Subtract | Binary::Least | Binary::Greatest | Binary::Hypotenuse => {
            Quantity::Of(of)
        }
        Binary::ArcTangent2 => Quantity::Of(Dimension::NONE),
        Binary::Multiply | Binary::Divide | Binary::Power => Quantity::Any(None),
    }
}

/// The dimension of a program's value, where numbers and parameters leave it none but one; `None` where it may have any.
///
/// # Errors
/// The first operation on quantities that don't go together.
pub fn dimension(program: &Program, variables: &[Dimension]) -> Result<Option<Dimension>, ExpressionError> {
    let variables: Vec<Quantity> = variables.iter().map(|of| Quantity::Of(*of)).collect();
    let mut first = None;
    let value = program.run_watched(&variables, |index, made| {
        if let (None, Quantity::Wrong(clash)) = (first, made) {
            first = Some((index, clash));
        }
    });
    let Some((index, clash)) = first else {
        return Ok(if let Quantity::Of(dimension) = value { Some(dimension) } else { None });
    };
    let at = program.places.get(index).map_or(0, |at| usize::from(*at));
    let (found, expected) = match clash {
        Clash::Unlike(one, two) => {
            (format!("{one} beside {two}"), "quantities of one unit, or a parameter that brings them there")
        }
        Clash::Argument(of) => {
            (format!("a function of {of}"), "a pure number, as the quantity divided by a parameter is")
        }
    };
    Err(ExpressionError::new(at, found, expected))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::compile;

    fn of(text: &str) -> Result<Option<Dimension>, usize> {
        let names = ["speed", "angle", "pressure", "warmth"];
        let per_s = Dimension::TIME.to_the(-1.0);
        let variables = [per_s, Dimension::NONE, Dimension::PRESSURE, Dimension::TEMPERATURE];
        let parameters: Vec<(&str, f64)> =
            if text.contains('a') && text.starts_with("a*") { vec![("a", 2.0)] } else { Vec::new() };
        dimension(&compile(text, &names, &parameters).unwrap(), &variables).map_err(|error| error.at)
    }

    #[test]
    fn unlike_quantities_are_found_where_they_meet() {
        let per_s = Dimension::TIME.to_the(-1.0);
        for (text, expected) in [
            ("speed", Ok(Some(per_s))),
            ("speed + angle", Err(6)),
            ("speed - 0.1", Ok(Some(per_s))),
            ("speed*abs(speed)", Ok(Some(per_s.to_the(2.0)))),
            ("sqrt(pressure)*pressure^0.5", Ok(Some(Dimension::PRESSURE))),
            ("sin(angle)", Ok(Some(Dimension::NONE))),
            ("sin(speed)", Err(0)),
            ("tanh(speed/0.1)", Ok(None)),
            ("exp(0.02*(warmth - 40))", Ok(None)),
            ("max(speed, pressure)", Err(0)),
            ("atan2(speed, abs(speed))", Ok(Some(Dimension::NONE))),
            ("angle^speed", Err(5)),
            ("sign(pressure) + angle", Ok(Some(Dimension::NONE))),
            ("a*speed + 3*pressure", Ok(None)),
            ("speed/speed - angle", Ok(Some(Dimension::NONE))),
        ] {
            assert_eq!(of(text), expected, "{text}");
        }
    }

    #[test]
    fn dimensions_are_told_in_units() {
        let per_s = Dimension::TIME.to_the(-1.0);
        assert_eq!(Dimension::NONE.to_string(), "a pure number");
        assert_eq!(per_s.to_the(2.0).to_string(), "1/s^2");
        assert_eq!(Dimension::PRESSURE.to_the(0.5).times(per_s, 1.0).to_string(), "Pa^0.5/s");
        assert_eq!(Dimension::TORQUE.times(per_s, -2.0).to_string(), "N*m*s^2");
        assert_eq!(Dimension::TORQUE.to_the(-2.0).to_string(), "1/(N*m)^2");
        assert_eq!(Dimension::FORCE.times(Dimension::TEMPERATURE, -1.0).to_string(), "N/K");
        assert_eq!(Dimension::LENGTH.to_the(3.0).to_string(), "m^3");
    }
}

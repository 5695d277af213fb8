//! Quantities as people write them, "17deg" or "40 L/min", turned into SI; and back, for messages.

use std::f64::consts::PI;

/// What kind of quantity a text is read as. Bare numbers are in its first unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// Seconds.
    Time,
    /// Radians.
    Angle,
    /// Radians per second.
    Speed,
    /// Radians per second squared.
    Acceleration,
    /// Radians per second cubed.
    Jerk,
    /// Cubic metres per second.
    Flow,
    /// Pascals.
    Pressure,
    /// Degrees Celsius.
    Temperature,
    /// Hertz.
    Frequency,
    /// Micro-steps per second, in hertz.
    PulseRate,
    /// Change of a pulse rate, in hertz per second.
    PulseAcceleration,
    /// A plain ratio, 1 = 100 %.
    Ratio,
}

/// A unit: value in SI = number × numerator / denominator. Two factors, so that "0.1ms" becomes the double nearest 1e-4.
struct Unit(&'static str, f64, f64);

const TIME: &[Unit] = &[
    Unit("s", 1.0, 1.0),
    Unit("ms", 1.0, 1e3),
    Unit("us", 1.0, 1e6),
    Unit("ns", 1.0, 1e9),
    Unit("min", 60.0, 1.0),
    Unit("h", 3600.0, 1.0),
    Unit("d", 86_400.0, 1.0),
    Unit("µs", 1.0, 1e6),
];
const ANGLE: &[Unit] = &[
    Unit("rad", 1.0, 1.0),
    Unit("mrad", 1.0, 1e3),
    Unit("deg", PI, 180.0),
    Unit("turn", 2.0 * PI, 1.0),
    Unit("°", PI, 180.0),
];
const SPEED: &[Unit] = &[Unit("rad/s", 1.0, 1.0), Unit("deg/s", PI, 180.0), Unit("rpm", PI, 30.0)];
const ACCELERATION: &[Unit] = &[
    Unit("rad/s2", 1.0, 1.0),
    Unit("deg/s2", PI, 180.0),
    Unit("rad/s^2", 1.0, 1.0),
    Unit("deg/s^2", PI, 180.0),
];
const JERK: &[Unit] = &[
    Unit("rad/s3", 1.0, 1.0),
    Unit("deg/s3", PI, 180.0),
    Unit("rad/s^3", 1.0, 1.0),
    Unit("deg/s^3", PI, 180.0),
];
const FLOW: &[Unit] = &[Unit("m3/s", 1.0, 1.0), Unit("L/min", 1.0, 6e4), Unit("mL/s", 1.0, 1e6)];
const PRESSURE: &[Unit] =
    &[Unit("Pa", 1.0, 1.0), Unit("kPa", 1e3, 1.0), Unit("MPa", 1e6, 1.0), Unit("bar", 1e5, 1.0)];
const TEMPERATURE: &[Unit] = &[Unit("degC", 1.0, 1.0), Unit("°C", 1.0, 1.0)];
const FREQUENCY: &[Unit] =
    &[Unit("Hz", 1.0, 1.0), Unit("kHz", 1e3, 1.0), Unit("MHz", 1e6, 1.0), Unit("mHz", 1.0, 1e3)];
const PULSE_RATE: &[Unit] = &[Unit("Hz", 1.0, 1.0), Unit("kHz", 1e3, 1.0), Unit("MHz", 1e6, 1.0)];
const PULSE_ACCELERATION: &[Unit] =
    &[Unit("Hz/s", 1.0, 1.0), Unit("kHz/s", 1e3, 1.0), Unit("MHz/s", 1e6, 1.0)];
const RATIO: &[Unit] = &[Unit("", 1.0, 1.0), Unit("%", 1.0, 1e2)];

/// Units that a message may be written in, the largest first.
const DISPLAYED_TIME: &[&str] = &["d", "s", "ms", "us", "ns"];
const DISPLAYED_FLOW: &[&str] = &["L/min"];
const DISPLAYED_PRESSURE: &[&str] = &["MPa", "kPa", "Pa"];
const DISPLAYED_FREQUENCY: &[&str] = &["MHz", "kHz", "Hz"];
const DISPLAYED_PULSE_ACCELERATION: &[&str] = &["MHz/s", "kHz/s", "Hz/s"];

impl Dimension {
    fn units(self) -> &'static [Unit] {
        match self {
            Self::Time => TIME,
            Self::Angle => ANGLE,
            Self::Speed => SPEED,
            Self::Acceleration => ACCELERATION,
            Self::Jerk => JERK,
            Self::Flow => FLOW,
            Self::Pressure => PRESSURE,
            Self::Temperature => TEMPERATURE,
            Self::Frequency => FREQUENCY,
            Self::PulseRate => PULSE_RATE,
            Self::PulseAcceleration => PULSE_ACCELERATION,
            Self::Ratio => RATIO,
        }
    }

    /// The names of its units; of ratios, nothing is one.
    pub(crate) fn unit_names(self) -> impl Iterator<Item = &'static str> {
        self.units().iter().map(|unit| unit.0)
    }

    /// The dimension with its article, as in "expected a time".
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "a time",
            Self::Angle => "an angle",
            Self::Speed => "a speed",
            Self::Acceleration => "an acceleration",
            Self::Jerk => "a jerk",
            Self::Flow => "a flow",
            Self::Pressure => "a pressure",
            Self::Temperature => "a temperature",
            Self::Frequency => "a frequency",
            Self::PulseRate => "a pulse rate",
            Self::PulseAcceleration => "a pulse acceleration",
            Self::Ratio => "a ratio",
        }
    }

    /// The unit of bare numbers; empty for a ratio.
    #[must_use]
    pub fn si_unit(self) -> &'static str {
        self.units().first().map_or("", |unit| unit.0)
    }

    /// The units that may be written, as a list for messages.
    #[must_use]
    pub fn unit_list(self) -> String {
        let names: Vec<&str> =
            self.units().iter().map(|unit| unit.0).filter(|name| !name.is_empty()).collect();
        names.join(", ")
    }

    fn displayed_units(self) -> &'static [&'static str] {
        match self {
            Self::Time => DISPLAYED_TIME,
            Self::Flow => DISPLAYED_FLOW,
            Self::Pressure => DISPLAYED_PRESSURE,
            Self::Frequency | Self::PulseRate => DISPLAYED_FREQUENCY,
            Self::PulseAcceleration => DISPLAYED_PULSE_ACCELERATION,
            _ => &[],
        }
    }

    /// A value in SI as a message shows it: at most six digits, in the largest unit that leaves a number of at least 1. Angles
    /// and speeds are in degrees, as the commands print them and files have them.
    #[must_use]
    pub fn display(self, value_si: f64) -> String {
        let in_degrees = |unit: &&Unit| unit.0.starts_with("deg");
        let fits = |unit: &&Unit| value_si.abs() * unit.2 / unit.1 >= 1.0 - 1e-9;
        let named = |name: &&str| self.units().iter().find(|unit| unit.0 == *name);
        let unit = match self {
            Self::Angle | Self::Speed => self.units().iter().find(in_degrees),
            _ => self.displayed_units().iter().filter_map(named).find(fits),
        };
        let unit = unit.or(self.units().first());
        let (name, number) = unit.map_or(("", value_si), |unit| (unit.0, value_si * unit.2 / unit.1));
        format!("{} {name}", six_digits(number)).trim_end().to_owned()
    }
}

/// A value in SI with its unit.
pub(crate) fn display_si(value_si: f64, dimension: Dimension) -> String {
    format!("{} {}", six_digits(value_si), dimension.si_unit()).trim_end().to_owned()
}

/// A number rounded to six significant digits, without trailing zeros.
fn six_digits(number: f64) -> String {
    let rounded: f64 = format!("{number:.5e}").parse().unwrap_or(number);
    if rounded != 0.0 && !(1e-4..1e7).contains(&rounded.abs()) {
        return format!("{rounded:e}");
    }
    rounded.to_string()
}

/// Why a text is no quantity.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("found {found}, expected {expected}")]
pub struct QuantityError {
    /// The text as it stands.
    pub found: String,
    /// What may stand there.
    pub expected: String,
}

/// Reads a number with a unit, such as `17deg`, `-1.5e-3 rad` or `40 L/min`, and gives it in SI.
///
/// A blank may stand between number and unit. NaN and infinities are refused.
///
/// ```
/// use config::{Dimension, parse_quantity};
///
/// assert_eq!(parse_quantity("180deg", Dimension::Angle), Ok(std::f64::consts::PI));
/// assert!(parse_quantity("180 apples", Dimension::Angle).is_err());
/// ```
///
/// # Errors
/// When the number or the unit is missing or unknown, or the value is not finite.
pub fn parse_quantity(text: &str, dimension: Dimension) -> Result<f64, QuantityError> {
    let refused = || QuantityError { found: found(text), expected: with_units(dimension) };
    let trimmed = text.trim();
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
    let split = trimmed.find(|c: char| !is_number(c)).unwrap_or(trimmed.len());
    let (number, unit_name) = trimmed.split_at_checked(split).ok_or_else(refused)?;
    let number: f64 = number.parse().map_err(|_| refused())?;
    let unit = dimension.units().iter().find(|unit| unit.0 == unit_name.trim()).ok_or_else(refused)?;
    let value = number * unit.1 / unit.2;
    if value.is_finite() { Ok(value) } else { Err(refused()) }
}

/// What was found, with a word on a decimal comma: half of Europe types one.
fn found(text: &str) -> String {
    let decimal_comma = |parts: (&str, &str)| {
        let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
        digit(parts.0.chars().next_back()) && digit(parts.1.chars().next())
    };
    let shown = shown(text);
    if text.split_once(',').is_some_and(decimal_comma) {
        return format!("{shown} with a decimal comma (a point is meant: {})", shown.replacen(',', ".", 1));
    }
    shown
}

fn with_units(dimension: Dimension) -> String {
    if dimension == Dimension::Ratio {
        return "a ratio such as 0.5 or \"50%\"".to_owned();
    }
    format!("{} with a unit ({})", dimension.name(), dimension.unit_list())
}

/// A text fit for one line of a message: control characters escaped, cut after 60 characters.
pub(crate) fn shown(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut shown: String = text.trim().chars().take(LONGEST).flat_map(escape_control).collect();
    if shown.is_empty() {
        return "an empty text".to_owned();
    }
    if text.trim().chars().count() > LONGEST {
        shown.push('…');
    }
    shown
}

fn escape_control(c: char) -> Vec<char> {
    if c.is_control() { c.escape_default().collect() } else { vec![c] }
}

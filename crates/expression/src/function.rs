//! The functions that an expression may call, with their derivatives.

use serde::{Deserialize, Serialize};

/// A function of one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unary {
    /// −x
    Negative,
    /// |x|
    Absolute,
    /// −1, 0 or 1
    Sign,
    /// √x
    Root,
    /// eˣ
    Exponential,
    /// The natural logarithm.
    Logarithm,
    /// sin x
    Sine,
    /// cos x
    Cosine,
    /// tan x
    Tangent,
    /// arcsin x
    ArcSine,
    /// arccos x
    ArcCosine,
    /// arctan x
    ArcTangent,
    /// tanh x
    HyperbolicTangent,
}

/// A function of two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Binary {
    /// x + y
    Add,
    /// x − y
    Subtract,
    /// x·y
    Multiply,
    /// x/y
    Divide,
    /// xʸ
    Power,
    /// The smaller one.
    Least,
    /// The greater one.
    Greatest,
    /// The angle of the point (second, first) from the x-axis.
    ArcTangent2,
    /// √(x² + y²)
    Hypotenuse,
}

/// A function by the name that expressions have for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Function {
    One(Unary),
    Two(Binary),
}

pub(crate) const FUNCTIONS: [(&str, Function); 16] = [
    ("abs", Function::One(Unary::Absolute)),
    ("sign", Function::One(Unary::Sign)),
    ("sqrt", Function::One(Unary::Root)),
    ("exp", Function::One(Unary::Exponential)),
    ("ln", Function::One(Unary::Logarithm)),
    ("sin", Function::One(Unary::Sine)),
    ("cos", Function::One(Unary::Cosine)),
    ("tan", Function::One(Unary::Tangent)),
    ("asin", Function::One(Unary::ArcSine)),
    ("acos", Function::One(Unary::ArcCosine)),
    ("atan", Function::One(Unary::ArcTangent)),
    ("tanh", Function::One(Unary::HyperbolicTangent)),
    ("min", Function::Two(Binary::Least)),
    ("max", Function::Two(Binary::Greatest)),
    ("atan2", Function::Two(Binary::ArcTangent2)),
    ("hypot", Function::Two(Binary::Hypotenuse)),
];

impl Function {
    pub fn from_name(name: &str) -> Option<Self> {
        FUNCTIONS.iter().find(|(known, _)| *known == name).map(|(_, function)| *function)
    }

    /// How many numbers it takes.
    pub fn arguments(self) -> usize {
        match self {
            Self::One(_) => 1,
            Self::Two(_) => 2,
        }
    }
}

impl Unary {
    /// Its value.
    pub fn of(self, x: f64) -> f64 {
        match self {
            Self::Negative => -x,
            Self::Absolute => x.abs(),
            Self::Sign => sign(x),
            Self::Root => x.sqrt(),
            Self::Exponential => x.exp(),
            Self::Logarithm => x.ln(),
            Self::Sine => x.sin(),
            Self::Cosine => x.cos(),
            Self::Tangent => x.tan(),
            Self::ArcSine => x.asin(),
            Self::ArcCosine => x.acos(),
            Self::ArcTangent => x.atan(),
            Self::HyperbolicTangent => x.tanh(),
        }
    }

    /// Its derivative, where `value` is its value; 0 at a corner.
    pub(crate) fn slope(self, x: f64, value: f64) -> f64 {
        match self {
            Self::Negative => -1.0,
            Self::Absolute => sign(x),
            Self::Sign => 0.0,
            Self::Root => 0.5 / value,
            Self::Exponential => value,
            Self::Logarithm => 1.0 / x,
            Self::Sine => x.cos(),
            Self::Cosine => -x.sin(),
            Self::Tangent => 1.0 + value * value,
            Self::ArcSine => 1.0 / (1.0 - x * x).sqrt(),
            Self::ArcCosine => -1.0 / (1.0 - x * x).sqrt(),
            Self::ArcTangent => 1.0 / (1.0 + x * x),
            Self::HyperbolicTangent => 1.0 - value * value,
        }
    }
}

impl Binary {
    /// Its value.
    pub fn of(self, x: f64, y: f64) -> f64 {
        match self {
            Self::Add => x + y,
            Self::Subtract => x - y,
            Self::Multiply => x * y,
            Self::Divide => x / y,
            Self::Power => power(x, y),
            // Unlike f64's own, nothing if one is no number.
            Self::Least if x.is_nan() || y.is_nan() => f64::NAN,
            Self::Greatest if x.is_nan() || y.is_nan() => f64::NAN,
            Self::Least => x.min(y),
            Self::Greatest => x.max(y),
            Self::ArcTangent2 => x.atan2(y),
            Self::Hypotenuse => x.hypot(y),
        }
    }

    /// Its derivatives by both, where `value` is its value.
    pub(crate) fn slopes(self, x: f64, y: f64, value: f64) -> (f64, f64) {
        match self {
            Self::Add => (1.0, 1.0),
            Self::Subtract => (1.0, -1.0),
            Self::Multiply => (y, x),
            Self::Divide => (1.0 / y, -value / y),
            Self::Power => (y * power(x, y - 1.0), value * x.ln()),
            Self::Least => {
                if x <= y {
                    (1.0, 0.0)
                } else {
                    (0.0, 1.0)
                }
            }
            Self::Greatest => {
                if x >= y {
                    (1.0, 0.0)
                } else {
                    (0.0, 1.0)
                }
            }
            Self::ArcTangent2 => {
                let square = x * x + y * y;
                (y / square, -x / square)
            }
            Self::Hypotenuse => (x / value, y / value),
        }
    }
}

fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// xʸ, by multiplication where y is a small whole number: exact, and quick.
fn power(x: f64, y: f64) -> f64 {
    const MOST: f64 = 32.0;
    if y.fract() == 0.0 && y.abs() <= MOST { x.powi(y as i32) } else { x.powf(y) }
}
